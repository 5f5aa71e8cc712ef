/* A machine in C or C++ that publishes samples, follows the verdicts on them, and acknowledges the alarm: it stands across a
 * slope and slews its arm from uphill to downhill.
 *
 *     cc -std=c11 live/examples/client.c $(pkg-config --cflags --libs tipwatch_client) -lm -o client
 *     tipwatch-live monitor --machine tests/data/tiny.toml & ./client tests/data/tiny.toml tests/data/tiny.urdf 6
 *
 * The level to act on is printed whenever it changes. */
#define _POSIX_C_SOURCE 200809L

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "tipwatch_client_library.h"

#define PERIOD_NS 10000000
#define DELIVERY_NS 500000000
#define MONITOR_WAIT_NS INT64_C(20000000000)
#define GRAVITY 9.8066
#define SLOPE 0.42
#define SLEW 1.2
#define PI 3.14159265358979

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void sleep_until(int64_t time_ns)
{
    struct timespec until;
    until.tv_sec = (time_t)(time_ns / 1000000000);
    until.tv_nsec = (long)(time_ns % 1000000000);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}

/* A sensor has noise: one that repeats itself while the arm moves is taken for frozen. */
static double noise(double sigma)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        sum += rand() / (double)RAND_MAX;
    }
    return sigma * sum;
}

static size_t read_file(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    size_t length = file ? fread(text, 1, size, file) : 0;
    if (!file || length == size) {
        fprintf(stderr, "%s: expected a file of less than %zu bytes\n", path, size);
        exit(2);
    }
    fclose(file);
    return length;
}

static const char *const JOINTS[] = {"slew",     "lift",     "tilt",     "extension", "steer_fl",
                                     "steer_fr", "wheel_fl", "wheel_fr", "wheel_rl",  "wheel_rr"};
enum { JOINT_COUNT = 10 };

static const char *level_name(enum tipwatch_level level)
{
    static const char *const names[] = {"unknown", "safe", "notice", "warning", "danger", "fault", "assumed"};
    return names[level];
}

/* The sensors that the machine file binds, now; the arm is uphill at `start_ns` and downhill so many seconds later. */
static int send_all(struct tipwatch_producer *producer, int64_t start_ns, double seconds)
{
    int64_t stamp_ns = clock_ns(CLOCK_REALTIME);
    double turn_per_s = PI / seconds;
    double turn = turn_per_s * (double)(stamp_ns - start_ns) * 1e-9;
    double imu[10] = {0, GRAVITY * sin(SLOPE), GRAVITY * cos(SLOPE), 0, 0, 0, sin(SLOPE / 2), 0, 0, cos(SLOPE / 2)};
    double odometry[10] = {0, 0, 0, 0, 0, 0, sin(SLOPE / 2), 0, 0, cos(SLOPE / 2)};
    double joints[2 * JOINT_COUNT] = {0};
    for (int i = 0; i < 3; i++) {
        imu[i] += noise(0.02);
        imu[3 + i] = noise(0.001);
        odometry[i] = noise(0.001);
        odometry[3 + i] = noise(0.001);
    }
    joints[0] = SLEW * cos(turn);
    joints[1] = -1.33;
    joints[2] = -1.9;
    joints[3] = 0.1;
    joints[JOINT_COUNT] = -SLEW * turn_per_s * sin(turn);
    if (tipwatch_send(producer, TIPWATCH_KIND_IMU, 0, stamp_ns, imu, 10) < 0 ||
        tipwatch_send(producer, TIPWATCH_KIND_ODOMETRY, 0, stamp_ns, odometry, 10) < 0) {
        return -1;
    }
    return tipwatch_send(producer, TIPWATCH_KIND_JOINTS, 0, stamp_ns, joints, 2 * JOINT_COUNT);
}

/* What the driver of the machine is told. */
struct cab {
    enum tipwatch_level shown;
    /* Acknowledgements that were sent. */
    uint64_t acknowledged;
    int is_confirmed;
};

/* Looks at the last verdict: shows the level, and acknowledges the alarm. Here the program does so itself, at once; on a
 * machine that is a button for somebody who has seen the alarm. */
static int look(struct cab *cab, const struct tipwatch_subscriber *subscriber, uint64_t source)
{
    const struct tipwatch_verdict *verdict = &subscriber->verdict;
    enum tipwatch_level level = tipwatch_level_now(subscriber);
    if (level != cab->shown) {
        cab->shown = level;
        printf("%s\n", level_name(level));
    }
    if (!subscriber->has_verdict || verdict->session != source) {
        return 0;
    }
    if (verdict->alarm != 0 && !verdict->alarm_acknowledged && cab->acknowledged == 0) {
        return tipwatch_send_acknowledge(subscriber->transport, source, &cab->acknowledged, verdict);
    }
    if (cab->acknowledged > 0 && !cab->is_confirmed && (verdict->alarm == 0 || verdict->alarm_acknowledged)) {
        cab->is_confirmed = 1;
        printf("the monitor confirms the acknowledgement\n");
    }
    return 0;
}

/* A session of so many seconds. */
static int run(const struct tipwatch_transport *transport, uint64_t machine_hash, double seconds)
{
    static struct tipwatch_session session;
    struct tipwatch_producer producer;
    struct tipwatch_subscriber subscriber;
    struct cab cab = {TIPWATCH_LEVEL_UNKNOWN, 0, 0};
    int64_t start_ns, end_ns, next_ns;
    uint64_t own = 0;
    memset(&producer, 0, sizeof producer);
    memset(&subscriber, 0, sizeof subscriber);
    producer.transport = subscriber.transport = transport;
    producer.source = (uint64_t)clock_ns(CLOCK_REALTIME) ^ ((uint64_t)getpid() << 32);
    producer.machine_hash = subscriber.machine_hash = machine_hash;
    session.pace = 1.0;
    session.has_imu = 1;
    session.has_odometry = 1;
    for (int i = 0; i < JOINT_COUNT; i++) {
        if (tipwatch_add_joint(&session, 0, JOINTS[i]) < 0) {
            return -1;
        }
    }
    /* a monitor sends verdicts without a session, too */
    end_ns = clock_ns(CLOCK_MONOTONIC) + MONITOR_WAIT_NS;
    while (!subscriber.has_verdict) {
        if (tipwatch_wait(&subscriber, PERIOD_NS) < 0) {
            return -1;
        }
        if (clock_ns(CLOCK_MONOTONIC) > end_ns) {
            fprintf(stderr, "expected verdicts, found none: is a monitor running?\n");
            return -1;
        }
    }
    /* stamps are Unix time: both clocks, read at one moment */
    session.clock_stamp_ns = clock_ns(CLOCK_REALTIME);
    session.clock_host_ns = clock_ns(CLOCK_MONOTONIC);
    if (tipwatch_announce(&producer, &session) < 0) {
        return -1;
    }
    start_ns = clock_ns(CLOCK_REALTIME);
    next_ns = clock_ns(CLOCK_MONOTONIC);
    end_ns = next_ns + (int64_t)(seconds * 1e9);
    while (next_ns < end_ns) {
        int taken;
        if (send_all(&producer, start_ns, seconds) < 0) {
            return -1;
        }
        /* a wait would be too coarse for this pace: by then the verdict is there */
        next_ns += PERIOD_NS;
        sleep_until(next_ns);
        taken = tipwatch_poll(&subscriber);
        if (taken < 0 || look(&cab, &subscriber, producer.source) < 0) {
            return -1;
        }
        if (subscriber.has_verdict && subscriber.verdict.session == producer.source) {
            own += (uint64_t)taken;
        }
    }
    if (tipwatch_end(&producer) < 0) {
        return -1;
    }
    sleep_until(next_ns + DELIVERY_NS);
    printf("%llu verdicts of this session, %llu lost, %llu refused\n", (unsigned long long)own,
           (unsigned long long)subscriber.lost, (unsigned long long)subscriber.refused);
    return cab.is_confirmed ? 0 : 1;
}

int main(int count, char **arguments)
{
    static char machine[1 << 16], urdf[1 << 18];
    char error[1024];
    struct tipwatch_transport transport;
    struct tipwatch_client *client;
    uint64_t machine_hash;
    int failed;
    if (count != 4 && (count != 6 || strcmp(arguments[4], "--prefix") != 0)) {
        fprintf(stderr, "usage: client MACHINE.toml MACHINE.urdf SECONDS [--prefix PREFIX]\n");
        return 2;
    }
    machine_hash = tipwatch_machine_hash(machine, read_file(arguments[1], machine, sizeof machine), urdf,
                                         read_file(arguments[2], urdf, sizeof urdf));
    client = tipwatch_client_open(TIPWATCH_CONTRACT, NULL, count == 6 ? arguments[5] : NULL, error, sizeof error);
    if (!client) {
        fprintf(stderr, "%s\n", error);
        return 1;
    }
    transport = tipwatch_client_transport(client);
    failed = run(&transport, machine_hash, atof(arguments[3]));
    if (failed < 0) {
        fprintf(stderr, "%s\n", tipwatch_client_error(client));
    }
    tipwatch_client_close(client);
    return failed ? 1 : 0;
}
