/* A machine in C or C++ that publishes samples and follows the verdicts on them: it stands and slews its arm.
 *
 *     cc -std=c11 -Ilive/include live/examples/client.c -lm -o client
 *     ./client tests/data/tiny.toml tests/data/tiny.urdf 5
 *
 * The transport of this example is a pair of pipes: on stdout, and from stdin, each message is the suffix of its service in 16
 * bytes, its size in 8 bytes, and itself; a notification has the size 0. On a machine these functions call iceoryx2. The level
 * to act on goes to stderr whenever it changes. */
#define _POSIX_C_SOURCE 200809L

#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "tipwatch_client.h"

#define SERVICE_BYTES 16
#define PERIOD_NS 10000000

static int write_frame(const char *service, const void *message, uint64_t size)
{
    char name[SERVICE_BYTES] = {0};
    strncpy(name, service, sizeof name - 1);
    if (fwrite(name, sizeof name, 1, stdout) != 1 || fwrite(&size, sizeof size, 1, stdout) != 1) {
        return -1;
    }
    return (size == 0 || fwrite(message, size, 1, stdout) == 1) && fflush(stdout) == 0 ? 0 : -1;
}

static int pipe_send(void *context, const char *service, const void *message, size_t size)
{
    (void)context;
    return write_frame(service, message, size);
}

static int pipe_notify(void *context, const char *service)
{
    (void)context;
    return write_frame(service, NULL, 0);
}

static int read_exactly(void *to, size_t size)
{
    size_t done = 0;
    while (done < size) {
        ssize_t count = read(STDIN_FILENO, (char *)to + done, size - done);
        if (count <= 0) {
            return -1;
        }
        done += (size_t)count;
    }
    return 0;
}

static int pipe_wait(void *context, const char *service, int64_t longest_ns)
{
    struct pollfd waiting = {STDIN_FILENO, POLLIN, 0};
    (void)context;
    (void)service;
    return poll(&waiting, 1, (int)(longest_ns / 1000000)) < 0 ? -1 : 0;
}

static int pipe_receive(void *context, const char *service, void *message, size_t size)
{
    struct pollfd waiting = {STDIN_FILENO, POLLIN, 0};
    char name[SERVICE_BYTES];
    uint64_t found;
    (void)context;
    if (poll(&waiting, 1, 0) <= 0 || !(waiting.revents & POLLIN)) {
        return 0;
    }
    if (read_exactly(name, sizeof name) < 0 || read_exactly(&found, sizeof found) < 0) {
        return -1;
    }
    if (strncmp(name, service, sizeof name) != 0 || found != size) {
        return -1;
    }
    return read_exactly(message, size) < 0 ? -1 : 1;
}

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int64_t monotonic_ns(void *context)
{
    (void)context;
    return clock_ns(CLOCK_MONOTONIC);
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

/* The sensors that the machine file binds, at one moment. */
static int send_all(struct tipwatch_producer *producer, double elapsed_s)
{
    int64_t stamp_ns = clock_ns(CLOCK_REALTIME);
    double imu[10] = {noise(0.02), noise(0.02), 9.8066 + noise(0.02), noise(0.001), noise(0.001), noise(0.001), 0, 0, 0, 1};
    double odometry[10] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    double joints[2 * JOINT_COUNT] = {0};
    for (int i = 0; i < 6; i++) {
        odometry[i] = noise(0.001);
    }
    joints[0] = 0.8 * sin(0.5 * elapsed_s);
    joints[1] = -1.33;
    joints[2] = -1.9;
    joints[3] = 0.1;
    joints[JOINT_COUNT] = 0.4 * cos(0.5 * elapsed_s);
    if (tipwatch_send(producer, TIPWATCH_KIND_IMU, 0, stamp_ns, imu, 10) < 0 ||
        tipwatch_send(producer, TIPWATCH_KIND_ODOMETRY, 0, stamp_ns, odometry, 10) < 0) {
        return -1;
    }
    return tipwatch_send(producer, TIPWATCH_KIND_JOINTS, 0, stamp_ns, joints, 2 * JOINT_COUNT);
}

int main(int count, char **arguments)
{
    static char machine[1 << 16], urdf[1 << 18];
    static struct tipwatch_session session;
    struct tipwatch_transport transport = {NULL, pipe_send, pipe_notify, pipe_receive, pipe_wait, monotonic_ns};
    struct tipwatch_producer producer;
    struct tipwatch_subscriber subscriber;
    enum tipwatch_level level, shown = TIPWATCH_LEVEL_UNKNOWN;
    int64_t start_ns = monotonic_ns(NULL), next_ns = start_ns;
    uint64_t taken = 0;
    double seconds;
    if (count != 4) {
        fprintf(stderr, "usage: client MACHINE.toml MACHINE.urdf SECONDS\n");
        return 2;
    }
    seconds = atof(arguments[3]);
    memset(&producer, 0, sizeof producer);
    memset(&subscriber, 0, sizeof subscriber);
    producer.transport = subscriber.transport = &transport;
    producer.source = (uint64_t)clock_ns(CLOCK_REALTIME) ^ ((uint64_t)getpid() << 32);
    producer.machine_hash = subscriber.machine_hash =
        tipwatch_machine_hash(machine, read_file(arguments[1], machine, sizeof machine), urdf,
                              read_file(arguments[2], urdf, sizeof urdf));
    session.pace = 1.0;
    /* stamps are Unix time: both clocks, read at one moment */
    session.clock_stamp_ns = clock_ns(CLOCK_REALTIME);
    session.clock_host_ns = monotonic_ns(NULL);
    session.has_imu = 1;
    session.has_odometry = 1;
    for (int i = 0; i < JOINT_COUNT; i++) {
        if (tipwatch_add_joint(&session, 0, JOINTS[i]) < 0) {
            return 2;
        }
    }
    if (tipwatch_announce(&producer, &session) < 0) {
        return 1;
    }
    while (next_ns - start_ns < (int64_t)(seconds * 1e9)) {
        int64_t left_ns;
        if (send_all(&producer, (double)(next_ns - start_ns) * 1e-9) < 0) {
            return 1;
        }
        next_ns += PERIOD_NS;
        while ((left_ns = next_ns - monotonic_ns(NULL)) > 0) {
            int received = tipwatch_wait(&subscriber, left_ns);
            if (received < 0) {
                return 1;
            }
            taken += (uint64_t)received;
            if (left_ns < 1000000) {
                struct timespec rest = {0, (long)left_ns};
                nanosleep(&rest, NULL);
            }
        }
        level = tipwatch_level_now(&subscriber);
        if (level != shown) {
            shown = level;
            fprintf(stderr, "%s\n", level_name(level));
        }
    }
    if (tipwatch_end(&producer) < 0) {
        return 1;
    }
    fprintf(stderr, "%llu verdicts, %llu lost, %llu refused\n", (unsigned long long)taken,
            (unsigned long long)subscriber.lost, (unsigned long long)subscriber.refused);
    return 0;
}
