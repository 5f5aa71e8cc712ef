/* The checks of tipwatch_client.h, over a transport in memory. Exits with the line of the first check that fails. */
#include <math.h>
#include <stdio.h>

#include "tipwatch_client.h"

#define EXPECT(condition)                                                                                             \
    do {                                                                                                              \
        if (!(condition)) {                                                                                           \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition);                                                   \
            return 1;                                                                                                 \
        }                                                                                                             \
    } while (0)

/* The last message that was sent, the verdict that waits, and the time. */
struct memory {
    uint8_t sent[sizeof(struct tipwatch_session)];
    size_t size;
    const char *service;
    int notified;
    int has_waiting;
    struct tipwatch_verdict waiting;
    int64_t now_ns;
};

static int keep(void *context, const char *service, const void *message, size_t size)
{
    struct memory *memory = (struct memory *)context;
    memcpy(memory->sent, message, size);
    memory->service = service;
    memory->size = size;
    return 0;
}

static int notify(void *context, const char *service)
{
    (void)service;
    ((struct memory *)context)->notified += 1;
    return 0;
}

static int receive(void *context, const char *service, void *message, size_t size)
{
    struct memory *memory = (struct memory *)context;
    (void)service;
    if (!memory->has_waiting) {
        return 0;
    }
    memory->has_waiting = 0;
    memcpy(message, &memory->waiting, size);
    return 1;
}

static int wait(void *context, const char *service, int64_t longest_ns)
{
    (void)service;
    ((struct memory *)context)->now_ns += longest_ns;
    return 0;
}

static int64_t now_ns(void *context)
{
    return ((struct memory *)context)->now_ns;
}

static struct memory memory;

/* A verdict arrives. */
static int arrive(struct tipwatch_subscriber *subscriber, uint64_t source, uint64_t sequence, uint32_t level)
{
    struct tipwatch_head head = {0, sequence, source, 77, 0, 0};
    memset(&memory.waiting, 0, sizeof memory.waiting);
    memory.waiting.level = memory.waiting.latched_level = level;
    memory.waiting.valid_until_ns = memory.now_ns + 100;
    tipwatch_seal(&memory.waiting, sizeof memory.waiting, &head);
    memory.has_waiting = 1;
    return tipwatch_poll(subscriber);
}

/* What a valve driver does at time 2000 with such a command. */
static double valve(uint32_t mode, double opening, int64_t valid_until_ns, uint32_t actuator)
{
    struct tipwatch_head head = {0, 0, 6, 77, 0, 0};
    struct tipwatch_command command;
    memset(&command, 0, sizeof command);
    command.mode = mode;
    command.actuator_count = 2;
    command.opening[0] = command.opening[1] = opening;
    command.valid_until_ns = valid_until_ns;
    tipwatch_seal(&command, sizeof command, &head);
    if (tipwatch_opening_now(&command, actuator, 78, 2000) != 0.0) {
        return 99.0;
    }
    return tipwatch_opening_now(&command, actuator, 77, 2000);
}

int main(void)
{
    struct tipwatch_transport transport = {&memory, keep, notify, receive, wait, now_ns};
    struct tipwatch_producer producer;
    struct tipwatch_subscriber subscriber;
    static struct tipwatch_session session;
    struct tipwatch_sample sample;
    struct tipwatch_acknowledge acknowledge;
    static struct tipwatch_machine machine;
    double values[TIPWATCH_MAX_VALUES + 1] = {1.5, 2.5};
    uint64_t acknowledged = 0;
    memset(&producer, 0, sizeof producer);
    memset(&subscriber, 0, sizeof subscriber);
    producer.transport = subscriber.transport = &transport;
    producer.source = 5;
    producer.machine_hash = subscriber.machine_hash = 77;
    memory.now_ns = 1000;

    EXPECT(tipwatch_crc32("123456789", 9) == 0xcbf43926u);
    EXPECT(tipwatch_machine_hash("tip", 3, "watch", 5) == TIPWATCH_HASH_EXAMPLE);
    EXPECT(tipwatch_machine_hash("tipw", 4, "atch", 4) != TIPWATCH_HASH_EXAMPLE);

    EXPECT(tipwatch_add_joint(&session, 0, "slew") == 0 && tipwatch_add_joint(&session, 1, "lift") == 0);
    EXPECT(tipwatch_add_joint(&session, 0, "back") < 0 && tipwatch_add_joint(&session, 3, "beyond") < 0);
    EXPECT(tipwatch_add_joint(&session, 1, "a name of more than sixty-three bytes, which does not fit the field") < 0);
    EXPECT(session.joint_count == 2 && session.stream_count == 2 && session.joint_streams[1] == 1);
    EXPECT(tipwatch_announce(&producer, &session) == 0 && memory.notified == 0);
    EXPECT(memory.size == sizeof session && strcmp(memory.service, TIPWATCH_SESSION_SERVICE) == 0);
    EXPECT(tipwatch_check_message(memory.sent, memory.size, 77) == TIPWATCH_CHECK_GOOD);

    EXPECT(tipwatch_send(&producer, TIPWATCH_KIND_IMU, 0, 9, values, TIPWATCH_MAX_VALUES + 1) < 0);
    EXPECT(tipwatch_send(&producer, TIPWATCH_KIND_IMU, 0, 9, values, 2) == 0 && memory.notified == 1);
    EXPECT(tipwatch_send(&producer, TIPWATCH_KIND_IMU, 0, 9, values, 2) == 0 && memory.notified == 2);
    memcpy(&sample, memory.sent, sizeof sample);
    EXPECT(sample.sequence == 1 && sample.source == 5 && sample.time_ns == 9 && sample.published_ns == 1000);
    EXPECT(sample.value_count == 2 && sample.values[1] == 2.5 && sample.values[2] == 0.0);
    EXPECT(tipwatch_check_message(&sample, sizeof sample, 78) == TIPWATCH_CHECK_MACHINE);
    for (size_t bit = 0; bit < 8 * sizeof sample; bit += 7) {
        uint8_t *byte = (uint8_t *)&sample + bit / 8;
        *byte ^= (uint8_t)(1u << bit % 8);
        EXPECT(tipwatch_check_message(&sample, sizeof sample, 77) != TIPWATCH_CHECK_GOOD);
        *byte ^= (uint8_t)(1u << bit % 8);
    }
    memset(&sample, 0, sizeof sample);
    EXPECT(tipwatch_check_message(&sample, sizeof sample, 0) == TIPWATCH_CHECK_MAGIC);

    EXPECT(tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_FAULT);
    EXPECT(arrive(&subscriber, 3, 40, TIPWATCH_LEVEL_SAFE) == 1);
    EXPECT(tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_SAFE && subscriber.lost == 0);
    EXPECT(arrive(&subscriber, 3, 43, TIPWATCH_LEVEL_DANGER) == 1 && subscriber.lost == 2);
    EXPECT(arrive(&subscriber, 3, 42, TIPWATCH_LEVEL_SAFE) == 0 && subscriber.repeated == 1);
    EXPECT(tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_DANGER);
    EXPECT(arrive(&subscriber, 4, 0, TIPWATCH_LEVEL_SAFE) == 1 && subscriber.lost == 2);
    EXPECT(arrive(&subscriber, 4, 1, 99) == 1 && tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_FAULT);
    EXPECT(arrive(&subscriber, 4, 2, TIPWATCH_LEVEL_SAFE) == 1);
    EXPECT(tipwatch_wait(&subscriber, 100) == 0 && tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_SAFE);
    EXPECT(tipwatch_wait(&subscriber, 1) == 0 && tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_FAULT);
    EXPECT(arrive(&subscriber, 4, 3, TIPWATCH_LEVEL_SAFE) == 1);
    memory.waiting.utilisation = 0.5;
    memory.has_waiting = 1;
    EXPECT(tipwatch_poll(&subscriber) == 0 && subscriber.refused == 1);
    EXPECT(tipwatch_level_now(&subscriber) == TIPWATCH_LEVEL_FAULT);

    EXPECT(valve(TIPWATCH_MODE_FOLLOW, 0.5, 2000, 0) == 0.5 && valve(TIPWATCH_MODE_RAMP, -1.0, 2000, 1) == -1.0);
    EXPECT(valve(TIPWATCH_MODE_HOLD, 0.5, 2000, 0) == 0.0 && valve(77, 0.5, 2000, 0) == 0.0);
    EXPECT(valve(TIPWATCH_MODE_FOLLOW, 0.5, 1999, 0) == 0.0 && valve(TIPWATCH_MODE_FOLLOW, 0.5, 2000, 2) == 0.0);
    EXPECT(valve(TIPWATCH_MODE_FOLLOW, 1.5, 2000, 0) == 0.0 && valve(TIPWATCH_MODE_FOLLOW, NAN, 2000, 0) == 0.0);

    EXPECT(tipwatch_send_acknowledge(&transport, 8, &acknowledged, &subscriber.verdict) < 0);
    subscriber.verdict.alarm = TIPWATCH_LEVEL_DANGER;
    EXPECT(tipwatch_send_acknowledge(&transport, 8, &acknowledged, &subscriber.verdict) == 0 && acknowledged == 1);
    memcpy(&acknowledge, memory.sent, sizeof acknowledge);
    EXPECT(acknowledge.verdict_source == 4 && acknowledge.verdict_sequence == 3 && acknowledge.machine_hash == 77);
    EXPECT(acknowledge.signals == 0);
    EXPECT(tipwatch_check_message(&acknowledge, sizeof acknowledge, 77) == TIPWATCH_CHECK_GOOD);

    machine.joint_count = 2;
    memcpy(machine.joint_names[0], "slew", 5);
    memcpy(machine.joint_names[1], "lift", 5);
    subscriber.verdict.doubted = (uint64_t)1 << 9;
    EXPECT(tipwatch_send_acknowledge_joint(&transport, 8, &acknowledged, &subscriber.verdict, &machine, "slew") < 0);
    EXPECT(tipwatch_send_acknowledge_joint(&transport, 8, &acknowledged, &subscriber.verdict, &machine, "nobody") < 0);
    EXPECT(tipwatch_send_acknowledge_joint(&transport, 8, &acknowledged, &subscriber.verdict, &machine, "") < 0);
    EXPECT(acknowledged == 1);
    EXPECT(tipwatch_send_acknowledge_joint(&transport, 8, &acknowledged, &subscriber.verdict, &machine, "lift") == 0);
    memcpy(&acknowledge, memory.sent, sizeof acknowledge);
    EXPECT(acknowledge.signals == subscriber.verdict.doubted && acknowledge.verdict_sequence == 3 && acknowledged == 2);
    EXPECT(tipwatch_check_message(&acknowledge, sizeof acknowledge, 77) == TIPWATCH_CHECK_GOOD);
    return 0;
}
