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

/* How the machine stands. What cannot be computed is NaN. Whoever acts on it treats one that is
 * past valid_until_ns as a fault. */
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
    /* Until when it may be acted on (ns), by CLOCK_MONOTONIC. */
    int64_t valid_until_ns;
    /* The session that the monitor follows; 0 where there is none. */
    uint64_t session;
    /* Sequence number of the sample that made the row. */
    uint64_t sample_sequence;
    /* When that sample was published (ns), by CLOCK_MONOTONIC. */
    int64_t sample_published_ns;
    /* Rows so far. */
    uint64_t rows;
    /* Samples that never came. */
    uint64_t lost;
    /* Samples that came but could not be used. */
    uint64_t refused;
    /* Samples that came again. */
    uint64_t repeated;
    /* A row 1; between rows 2: the numbers are those of the last row. */
    uint32_t event;
    /* The level now: unknown 0, safe 1, notice 2, warning 3, danger 4, fault 5. */
    uint32_t level;
    /* The level to act on: danger stays until it is over and acknowledged. */
    uint32_t latched_level;
    /* Faults of the input since the row before, as bits. */
    uint32_t faults;
    /* Cautions of the input since the row before, as bits. */
    uint32_t cautions;
    /* Why the row is not valid, as bits. */
    uint32_t reasons;
    /* One where an acknowledgement came since the row before. */
    uint32_t acknowledged;
    /* One where real time was not checked: the samples are a replay's, as fast as possible. */
    uint32_t untimed;
    /* The wheel that lifts next; meaningless where the time is NaN. */
    uint32_t next_wheel;
    /* How many wheels there are. */
    uint32_t wheel_count;
    /* How many edges the support polygon has. */
    uint32_t edge_count;
    /* Zero. */
    uint32_t reserved;
    /* U = 1 - (OTF - 2 sigma) / static load of the worst wheel. */
    double utilisation;
    /* Time until the next wheel lifts if its load falls on as now (s); NaN beyond 5 s. */
    double time_to_lift_off_s;
    /* Sum of the loads (N). */
    double normal_force;
    /* Centre of pressure forward of the base (m). */
    double zmp_x;
    /* Centre of pressure to the left of the base (m). */
    double zmp_y;
    /* Distance of the centre of pressure from the nearest edge, inside positive (m). */
    double zmp_margin;
    /* Load transfer ratio, (right - left) / sum. */
    double ltr;
    /* Sigma (110) of the first paper (N2). */
    double sigma;
    /* Metric (35) of the second paper (N). */
    double spread;
    /* Load, by wheel (N). */
    double load[12];
    /* Load with all wheels held to the ground, by wheel (N). */
    double otf[12];
    /* Standard deviation of the load, by wheel (N). */
    double load_sigma[12];
    /* Standard deviation of the OTF, by wheel (N). */
    double otf_sigma[12];
    /* Least load that equilibrium allows, by wheel (N). */
    double load_min[12];
    /* Largest load that equilibrium allows, by wheel (N). */
    double load_max[12];
    /* What each cause contributes to the load, by cause and wheel (N): chassis_weight, wheel_weight,
     * arm_weight, slope, arm_motion, platform_acceleration, cornering, tool_force, warp,
     * lift_off, specific_force. */
    double causes[11][12];
    /* Overturning moment, wheel weights included, by edge (N m), negative = stable. */
    double itom_full[12];
    /* Overturning moment without wheel weights, by edge (N m). */
    double itom[12];
    /* Overturning moment of arm and chassis weight, by edge (N m). */
    double tom[12];
    /* Overturning moment of the arm alone, by edge (N m). */
    double mhs[12];
    /* Force-Angle, by edge (rad), positive = stable. */
    double force_angle[12];
    /* Stability angle, by edge (rad), positive = stable. */
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
