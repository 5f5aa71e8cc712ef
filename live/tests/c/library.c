/* The functions of libtipwatch_client.so, right and wrong calls of each: PROGRAM PREFIX. Exits with the line of the first check
 * that fails. */
#define _POSIX_C_SOURCE 200809L

#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tipwatch_client_library.h"

#define EXPECT(condition)                                                                                             \
    do {                                                                                                              \
        if (!(condition)) {                                                                                           \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition);                                                   \
            return 1;                                                                                                 \
        }                                                                                                             \
    } while (0)

static struct tipwatch_session session;
static struct tipwatch_sample sample, taken_sample;
static struct tipwatch_acknowledge acknowledge, taken;

/* The number of the first check that another thread, or a child, finds wrong; 0 if none. */
static int foreign(struct tipwatch_client *client)
{
    EXPECT(tipwatch_client_send(client, TIPWATCH_ACKNOWLEDGE_SERVICE, &acknowledge, sizeof acknowledge) ==
           TIPWATCH_CLIENT_THREAD);
    EXPECT(tipwatch_client_receive(client, TIPWATCH_ACKNOWLEDGE_SERVICE, &taken, sizeof taken) == TIPWATCH_CLIENT_THREAD);
    EXPECT(tipwatch_client_wait(client, TIPWATCH_SAMPLE_SERVICE, 0) == TIPWATCH_CLIENT_THREAD);
    EXPECT(tipwatch_client_close(client) == TIPWATCH_CLIENT_THREAD);
    EXPECT(strlen(tipwatch_client_error(client)) > 0);
    EXPECT(tipwatch_client_now_ns(client) > 0);
    return 0;
}

static void *thread(void *client)
{
    return foreign((struct tipwatch_client *)client) ? client : NULL;
}

/* The number of the first check that finds a closed client usable; 0 if none. */
static int is_closed(struct tipwatch_client *client)
{
    EXPECT(tipwatch_client_close(client) == TIPWATCH_CLIENT_CLOSED);
    EXPECT(tipwatch_client_send(client, TIPWATCH_ACKNOWLEDGE_SERVICE, &acknowledge, sizeof acknowledge) ==
           TIPWATCH_CLIENT_CLOSED);
    EXPECT(tipwatch_client_receive(client, TIPWATCH_ACKNOWLEDGE_SERVICE, &taken, sizeof taken) == TIPWATCH_CLIENT_CLOSED);
    EXPECT(tipwatch_client_wait(client, TIPWATCH_SAMPLE_SERVICE, 0) == TIPWATCH_CLIENT_CLOSED);
    EXPECT(tipwatch_client_notify(client, TIPWATCH_SAMPLE_SERVICE) == TIPWATCH_CLIENT_CLOSED);
    EXPECT(strlen(tipwatch_client_error(client)) > 0);
    return 0;
}

static int is_default(int number)
{
    struct sigaction action;
    return sigaction(number, NULL, &action) == 0 && action.sa_handler == SIG_DFL;
}

static int refuses_to_open(const char *prefix)
{
    char error[300], cut[6] = {'x', 'x', 'x', 'x', 'x', 'x'};
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT + 1, NULL, prefix, error, sizeof error));
    EXPECT(strstr(error, "TIPWATCH_CONTRACT"));
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT + 1, NULL, prefix, cut, 5));
    EXPECT(strlen(cut) == 4 && strncmp(error, cut, 4) == 0 && cut[5] == 'x');
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT, NULL, "not/a/name", error, sizeof error));
    EXPECT(strstr(error, "not/a/name"));
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT, "", prefix, error, sizeof error));
    EXPECT(strstr(error, "service"));
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT, "\xff", prefix, error, sizeof error));
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT, "\xff", prefix, NULL, 0));
    EXPECT(!tipwatch_client_open(TIPWATCH_CONTRACT, "\xff", prefix, cut, 0));
    return 0;
}

static int refuses_wrong_calls(struct tipwatch_client *client)
{
    const char *name = TIPWATCH_ACKNOWLEDGE_SERVICE;
    EXPECT(strlen(tipwatch_client_error(client)) == 0);
    EXPECT(tipwatch_client_send(NULL, name, &acknowledge, sizeof acknowledge) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(tipwatch_client_send(client, NULL, &acknowledge, sizeof acknowledge) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(tipwatch_client_send(client, "\xff", &acknowledge, sizeof acknowledge) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(tipwatch_client_send(client, name, NULL, sizeof acknowledge) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(strstr(tipwatch_client_error(client), "message"));
    EXPECT(tipwatch_client_send(client, "/nothing", &acknowledge, sizeof acknowledge) == TIPWATCH_CLIENT_SERVICE);
    EXPECT(strstr(tipwatch_client_error(client), "/nothing"));
    EXPECT(tipwatch_client_send(client, name, &sample, sizeof sample) == TIPWATCH_CLIENT_SIZE);
    EXPECT(tipwatch_client_send(client, name, &acknowledge, 0) == TIPWATCH_CLIENT_SIZE);
    EXPECT(tipwatch_client_receive(client, name, &taken, sizeof taken - 1) == TIPWATCH_CLIENT_SIZE);
    EXPECT(tipwatch_client_receive(client, name, NULL, sizeof taken) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(tipwatch_client_receive(NULL, name, &taken, sizeof taken) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(tipwatch_client_notify(client, name) == TIPWATCH_CLIENT_SERVICE);
    EXPECT(tipwatch_client_notify(NULL, TIPWATCH_SAMPLE_SERVICE) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(tipwatch_client_wait(client, name, 1) == TIPWATCH_CLIENT_SERVICE);
    EXPECT(tipwatch_client_wait(client, NULL, 1) == TIPWATCH_CLIENT_ARGUMENT);
    EXPECT(strlen(tipwatch_client_error(NULL)) > 0);
    return 0;
}

/* `sender` announces a session, and `reader` joins. */
static int carries_messages(struct tipwatch_client *sender, struct tipwatch_client *reader)
{
    struct tipwatch_transport from = tipwatch_client_transport(sender), to = tipwatch_client_transport(reader);
    struct tipwatch_verdict seen;
    struct tipwatch_producer producer;
    uint64_t sequence = 3;
    double values[2] = {1.5, 2.5};
    memset(&producer, 0, sizeof producer);
    memset(&seen, 0, sizeof seen);
    producer.transport = &from;
    producer.source = 5;
    producer.machine_hash = 77;
    EXPECT(tipwatch_announce(&producer, &session) == 0);
    /* a late joiner receives the session with what is sent next; its samples begin when it first asks */
    EXPECT(to.receive(to.context, TIPWATCH_SESSION_SERVICE, &session, sizeof session) == 0);
    EXPECT(to.wait(to.context, TIPWATCH_SAMPLE_SERVICE, 0) == 0);
    EXPECT(tipwatch_send(&producer, TIPWATCH_KIND_IMU, 0, 9, values, 2) == 0);
    EXPECT(tipwatch_client_wait(reader, TIPWATCH_SAMPLE_SERVICE, INT64_MAX) == 0);
    EXPECT(to.receive(to.context, TIPWATCH_SESSION_SERVICE, &session, sizeof session) == 1 && session.source == 5);
    EXPECT(to.receive(to.context, TIPWATCH_SAMPLE_SERVICE, &taken_sample, sizeof taken_sample) == 1);
    EXPECT(tipwatch_check_message(&taken_sample, sizeof taken_sample, 77) == TIPWATCH_CHECK_GOOD);
    EXPECT(taken_sample.time_ns == 9 && taken_sample.values[1] == 2.5);
    EXPECT(to.receive(to.context, TIPWATCH_SAMPLE_SERVICE, &taken_sample, sizeof taken_sample) == 0);
    /* the only place of its writer is taken */
    EXPECT(tipwatch_client_send(reader, TIPWATCH_SAMPLE_SERVICE, &taken_sample, sizeof taken_sample) ==
           TIPWATCH_CLIENT_SHARED_MEMORY);
    EXPECT(strlen(tipwatch_client_error(reader)) > 0);
    /* a failure is no end */
    EXPECT(from.receive(from.context, TIPWATCH_ACKNOWLEDGE_SERVICE, &taken, sizeof taken) == 0);
    seen.alarm = TIPWATCH_LEVEL_DANGER;
    seen.sequence = 40;
    seen.machine_hash = 77;
    EXPECT(tipwatch_send_acknowledge(&to, 8, &sequence, &seen) == 0);
    EXPECT(from.receive(from.context, TIPWATCH_ACKNOWLEDGE_SERVICE, &taken, sizeof taken) == 1);
    EXPECT(taken.verdict_sequence == 40 && taken.source == 8 && taken.sequence == 3);
    EXPECT(tipwatch_client_wait(reader, TIPWATCH_SAMPLE_SERVICE, -1) == 0);
    return 0;
}

static struct tipwatch_client *last;

/* Behind main, as a destructor of C++ does it. */
static void close_last(void)
{
    int result = tipwatch_client_close(last);
    if (result != 0) {
        fprintf(stderr, "at exit: %d\n", result);
        _exit(1);
    }
}

int main(int count, char **arguments)
{
    struct tipwatch_client *client, *other;
    pthread_t running;
    pid_t child;
    void *wrong;
    int status;
    char error[1024];
    int64_t before;
    EXPECT(count == 2);
    EXPECT(refuses_to_open(arguments[1]) == 0);
    client = tipwatch_client_open(TIPWATCH_CONTRACT, NULL, arguments[1], NULL, 0);
    other = tipwatch_client_open(TIPWATCH_CONTRACT, "tipwatch", arguments[1], error, sizeof error);
    EXPECT(client && other);
    EXPECT(is_default(SIGINT) && is_default(SIGTERM));
    EXPECT(refuses_wrong_calls(client) == 0);
    EXPECT(carries_messages(client, other) == 0);
    before = tipwatch_client_now_ns(NULL);
    EXPECT(before > 0 && tipwatch_client_now_ns(client) >= before);
    EXPECT(pthread_create(&running, NULL, thread, client) == 0 && pthread_join(running, &wrong) == 0 && !wrong);
    child = fork();
    if (child == 0)
        _exit(foreign(client) || foreign(other));
    EXPECT(child > 0 && waitpid(child, &status, 0) == child && status == 0);
    /* the parent's place is still taken, and its client works */
    EXPECT(tipwatch_client_send(other, TIPWATCH_SAMPLE_SERVICE, &taken_sample, sizeof taken_sample) ==
           TIPWATCH_CLIENT_SHARED_MEMORY);
    EXPECT(tipwatch_client_send(client, TIPWATCH_SAMPLE_SERVICE, &taken_sample, sizeof taken_sample) == 0);
    EXPECT(tipwatch_client_close(client) == 0 && tipwatch_client_close(other) == 0 && tipwatch_client_close(NULL) == 0);
    EXPECT(is_closed(client) == 0 && is_closed(other) == 0);
    other = tipwatch_client_open(TIPWATCH_CONTRACT, NULL, arguments[1], NULL, 0);
    EXPECT(other && other != client && is_closed(client) == 0 && tipwatch_client_close(other) == 0);
    last = tipwatch_client_open(TIPWATCH_CONTRACT, NULL, arguments[1], NULL, 0);
    EXPECT(last && atexit(close_last) == 0);
    return 0;
}
