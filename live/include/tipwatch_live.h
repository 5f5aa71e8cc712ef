/* Messages of tipwatch-live in shared memory (iceoryx2 0.10). Made by `tipwatch-live header`: do not edit.
 *
 * Every service has the attribute "layout" with the value of NAME_LAYOUT; its settings stand beside the
 * messages in book/src/reference/services.md. Numbers are in the computer's own byte order. */
#ifndef TIPWATCH_LIVE_H
#define TIPWATCH_LIVE_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define TIPWATCH_STATIC_ASSERT static_assert
#else
#define TIPWATCH_STATIC_ASSERT _Static_assert
#endif

#define TIPWATCH_MAGIC UINT64_C(144207827690342740)
#define TIPWATCH_SAMPLE_QUEUE UINT64_C(2048)
#define TIPWATCH_VERDICT_QUEUE UINT64_C(2048)
#define TIPWATCH_COMMAND_QUEUE UINT64_C(2048)
#define TIPWATCH_LATEST UINT64_C(1)
#define TIPWATCH_ACKNOWLEDGE_QUEUE UINT64_C(16)
#define TIPWATCH_PROGRESS_QUEUE UINT64_C(256)
#define TIPWATCH_ONE_WRITER UINT64_C(1)
#define TIPWATCH_MAX_READERS UINT64_C(8)
#define TIPWATCH_MAX_BORROWED UINT64_C(2)
#define TIPWATCH_MAX_NODES UINT64_C(24)
#define TIPWATCH_MAX_VALUES UINT64_C(128)
#define TIPWATCH_MAX_JOINTS UINT64_C(64)
#define TIPWATCH_MAX_PLACES UINT64_C(12)
#define TIPWATCH_NAME_BYTES UINT64_C(64)
#define TIPWATCH_DEFAULT_SERVICE "tipwatch"
#define TIPWATCH_SESSION_SUFFIX "/session"
#define TIPWATCH_SAMPLES_SUFFIX "/samples"
#define TIPWATCH_MACHINE_SUFFIX "/machine"
#define TIPWATCH_VERDICT_SUFFIX "/verdict"
#define TIPWATCH_COMMAND_SUFFIX "/command"
#define TIPWATCH_ACKNOWLEDGE_SUFFIX "/acknowledge"
#define TIPWATCH_PROGRESS_SUFFIX "/progress"
#define TIPWATCH_LAYOUT_ATTRIBUTE "layout"

/* What a reader must know before the first sample. Its source is the session's identity. */
#define TIPWATCH_SESSION_TYPE "tipwatch.Session.v2"
#define TIPWATCH_SESSION_LAYOUT "a383b7ad3727650b"
struct tipwatch_session {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* Samples of the session, the end not counted; 0 where nobody knows. */
    uint64_t total_samples;
    /* How many times as fast as real time the sensors' clock runs: 1 on a machine; 0 where it has
     * nothing to do with real time (a replay as fast as possible). */
    double pace;
    /* How many joints there are in all streams. */
    uint32_t joint_count;
    /* How many streams of joint states there are; the first is the fastest: it makes the rows. */
    uint32_t stream_count;
    /* One where there is an IMU. */
    uint32_t has_imu;
    /* One where there is odometry. */
    uint32_t has_odometry;
    /* One where the tool wrench is measured. */
    uint32_t has_tool_wrench;
    /* One where readers are to report their progress. */
    uint32_t wants_progress;
    /* A bit for each of the machine's actuated joints whose force is measured. */
    uint32_t actuated_joints;
    /* Zero. */
    uint32_t reserved;
    /* The frame that the IMU names; empty where it names none. */
    uint8_t imu_frame[64];
    /* The stream of each joint, ascending. */
    uint32_t joint_streams[64];
    /* The name of each joint, in the order of its stream's values. */
    uint8_t joint_names[64][64];
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_session) == 4520, "tipwatch_session");

/* One message of one sensor. */
#define TIPWATCH_SAMPLE_TYPE "tipwatch.Sample.v2"
#define TIPWATCH_SAMPLE_LAYOUT "357ddfec06de91b1"
struct tipwatch_sample {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* When the recorder of a replayed log received it (ns); 0 from a machine. */
    int64_t log_time_ns;
    /* Which kind of sensor: joints 1, IMU 2, odometry 3, tool wrench 4, end of the session 5, signal
     * of an actuator 6. */
    uint32_t kind;
    /* Which stream of this kind. */
    uint32_t stream;
    /* How many of the values it has. */
    uint32_t value_count;
    /* Zero. */
    uint32_t reserved;
    /* Joints: positions (rad, m), then rates, NaN where unknown. IMU: specific force (m/s2), angular
     * velocity (rad/s), attitude x y z w or NaN. Odometry: velocity (m/s), angular velocity, attitude.
     * Tool wrench: force (N), moment (N m) by the surroundings on the tool. Actuator: its
     * force (N) or a pressure (Pa). Zero beyond their count. */
    double values[128];
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_sample) == 1104, "tipwatch_sample");

/* What a reader of verdicts must know of the machine. */
#define TIPWATCH_MACHINE_TYPE "tipwatch.Machine.v1"
#define TIPWATCH_MACHINE_LAYOUT "ac47a7168ee83355"
struct tipwatch_machine {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* The session that the monitor follows. */
    uint64_t session;
    /* Utilisation of the levels notice, warning and danger. */
    double limits[3];
    /* How many wheels there are. */
    uint32_t wheel_count;
    /* How many edges the support polygon has. */
    uint32_t edge_count;
    /* Name of the machine. */
    uint8_t name[64];
    /* Names of the wheels, in lower case. */
    uint8_t wheel_names[12][64];
    /* Names of the edges, in lower case. */
    uint8_t edge_names[12][64];
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_machine) == 1696, "tipwatch_machine");

/* The verdict: how close the machine is to tipping. A number that cannot be computed is NaN.
 * Consumers must treat a verdict past valid_until_ns as a fault. */
#define TIPWATCH_VERDICT_TYPE "tipwatch.Verdict.v1"
#define TIPWATCH_VERDICT_LAYOUT "d86040924a46ff8b"
struct tipwatch_verdict {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* Time until which it may be acted on (ns), by CLOCK_MONOTONIC. */
    int64_t valid_until_ns;
    /* The session that the monitor follows; 0 without one. */
    uint64_t session;
    /* Sequence number of the sample that completed the row. */
    uint64_t sample_sequence;
    /* Publication time of that sample (ns), by CLOCK_MONOTONIC. */
    int64_t sample_published_ns;
    /* Rows so far. */
    uint64_t rows;
    /* Samples that never arrived. */
    uint64_t lost;
    /* Samples that arrived but could not be used. */
    uint64_t refused;
    /* Samples that arrived again. */
    uint64_t repeated;
    /* 1 a row; 2 between rows: the numbers are those of the last row. */
    uint32_t event;
    /* Current level: 0 unknown, 1 safe, 2 notice, 3 warning, 4 danger, 5 fault. */
    uint32_t level;
    /* Level to act on: danger stays until it has ended and was acknowledged. */
    uint32_t latched_level;
    /* Bits: faults of the input since the last row. */
    uint32_t faults;
    /* Bits: cautions of the input since the last row. */
    uint32_t cautions;
    /* Bits: why the row is not valid. */
    uint32_t reasons;
    /* 1 if an acknowledgement arrived since the last row. */
    uint32_t acknowledged;
    /* 1 if real time was not checked: the samples are replayed as fast as possible. */
    uint32_t untimed;
    /* Index of the wheel that lifts next; meaningless if the time is NaN. */
    uint32_t next_wheel;
    /* Number of wheels. */
    uint32_t wheel_count;
    /* Number of edges of the support polygon. */
    uint32_t edge_count;
    /* Zero. */
    uint32_t reserved;
    /* 1 - (OTF - 2 sigma) / static load of the worst wheel (-) */
    double utilisation;
    /* Time until the next wheel lifts if its load keeps falling at its present rate (s); NaN beyond 5 s. */
    double time_to_lift_off_s;
    /* Force of the ground along the normal of the contact plane: the sum of the loads (N) */
    double normal_force;
    /* Centre of pressure (ZMP), forward of the base origin's projection onto the contact plane (m) */
    double zmp_x;
    /* Centre of pressure (ZMP), to the left of the base origin's projection onto the contact plane (m) */
    double zmp_y;
    /* Distance of the centre of pressure from the nearest edge, positive inside (m) */
    double zmp_margin;
    /* Load transfer ratio: right minus left load, divided by the sum (-) */
    double ltr;
    /* Half the sum of squared differences between OTF and optimal load (N^2) */
    double sigma;
    /* Sum of the differences of the loads over all pairs of wheels, each pair once (N) */
    double spread;
    /* Load, never negative (N), by wheel */
    double load[12];
    /* OTF, the load with every wheel held to the ground; signed (N), by wheel */
    double otf[12];
    /* Standard deviation of the load (N), by wheel */
    double load_sigma[12];
    /* Standard deviation of the OTF (N), by wheel */
    double otf_sigma[12];
    /* Smallest load that equilibrium allows (N), by wheel */
    double load_min[12];
    /* Largest load that equilibrium allows (N), by wheel */
    double load_max[12];
    /* Contribution of a cause to the load (N), by cause and wheel: chassis_weight,
     * wheel_weight, arm_weight, slope, arm_motion, platform_acceleration, cornering, tool_force,
     * warp, lift_off, specific_force */
    double causes[11][12];
    /* ITOM about the edge, with the weights of the wheels (N m), by edge */
    double itom_full[12];
    /* ITOM: moment of arm, tool force, chassis weight and chassis inertia, negative while stable (N m), by edge */
    double itom[12];
    /* TOM: moment of arm, tool force and chassis weight, negative while stable (N m), by edge */
    double tom[12];
    /* MHS-type moment: arm and tool force, negative while stable (N m), by edge */
    double mhs[12];
    /* Force-Angle, positive while stable (rad), by edge */
    double force_angle[12];
    /* Force-Angle of gravity only, positive while stable (rad), by edge */
    double stability_angle[12];
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_verdict) == 2448, "tipwatch_verdict");

/* What the valves of the suspension should do. Whoever drives them closes them where it is past
 * valid_until_ns. By actuator, in the order of the machine file's suspension.linkages. */
#define TIPWATCH_COMMAND_TYPE "tipwatch.Command.v1"
#define TIPWATCH_COMMAND_LAYOUT "2874e99d6e950adb"
struct tipwatch_command {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* Until when it may be acted on (ns), by CLOCK_MONOTONIC. */
    int64_t valid_until_ns;
    /* The session that the control follows; 0 where there is none. */
    uint64_t session;
    /* Sequence number of the sample that made the row. */
    uint64_t sample_sequence;
    /* When that sample was published (ns), by CLOCK_MONOTONIC. */
    int64_t sample_published_ns;
    /* Sequence number of the last verdict that the control has seen. */
    uint64_t verdict_sequence;
    /* Rows so far. */
    uint64_t rows;
    /* A row 1; between rows 2. */
    uint32_t event;
    /* What the valves do: hold closed 0, ramp to closed 1, follow 2. */
    uint32_t mode;
    /* Why they do not follow, as bits. */
    uint32_t reasons;
    /* How the stabiliser found its last command: not asked 0, optimal 1, work limit 2, margin lost 3,
     * step too short 4, outside limits 5, no solution 6, position unknown 7. */
    uint32_t status;
    /* Level of the last verdict that the control has seen. */
    uint32_t level;
    /* How many actuators there are. */
    uint32_t actuator_count;
    /* Iterations of the search. */
    uint32_t iterations;
    /* How many motions of the suspension were looked at. */
    uint32_t evaluations;
    /* Opening of the valve, -1 to 1, positive where the rod is to go out. */
    double opening[2];
    /* Measured position of the rod (m). */
    double measured[2];
    /* Where the rod should be now (m); NaN where the valves do not follow. */
    double reference[2];
    /* How fast it should go (m/s); NaN where the valves do not follow. */
    double velocity[2];
    /* The optimum: where the rod is led (m), in literal mode its acceleration (m/s2). */
    double target[2];
    /* Cost (30) of the best point found; NaN where no problem was solved. */
    double cost;
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_command) == 224, "tipwatch_command");

/* Somebody has seen the alarm. */
#define TIPWATCH_ACKNOWLEDGE_TYPE "tipwatch.Acknowledge.v1"
#define TIPWATCH_ACKNOWLEDGE_LAYOUT "cd20c9dad28ba0ad"
struct tipwatch_acknowledge {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* The verdict that was seen. */
    uint64_t verdict_sequence;
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_acknowledge) == 64, "tipwatch_acknowledge");

/* How far a reader of samples is. Its source is the session that it reads. */
#define TIPWATCH_PROGRESS_TYPE "tipwatch.Progress.v1"
#define TIPWATCH_PROGRESS_LAYOUT "4993ddd99eb31b3a"
struct tipwatch_progress {
    /* MAGIC */
    uint64_t magic;
    /* Counts the messages of a source from zero: a jump is a loss. */
    uint64_t sequence;
    /* Tells this source from every other one. */
    uint64_t source;
    /* Hash of machine file and URDF. */
    uint64_t machine_hash;
    /* When what it says holds (ns), by the clock of the sensors. */
    int64_t time_ns;
    /* When it was published (ns), by CLOCK_MONOTONIC of this computer. */
    int64_t published_ns;
    /* The reader's identity in iceoryx2, the lower half. */
    uint64_t reader_low;
    /* The upper half. */
    uint64_t reader_high;
    /* The sequence number of the next sample that it wants; the largest number where it has had none. */
    uint64_t next;
    /* CRC-32 (the one of zlib) of all bytes before this number. */
    uint64_t checksum;
};
TIPWATCH_STATIC_ASSERT(sizeof(struct tipwatch_progress) == 80, "tipwatch_progress");

#endif
