/* A client of tipwatch-live in C (C11) and C++ (C++11): a producer of samples, a consumer of verdicts, a valve driver,
 * acknowledgements, and the checks of every message. Header only; no memory is allocated, and nothing waits but `wait`.
 *
 * The transport is that of tipwatch_client_library.h, or the caller's own: functions in a struct tipwatch_transport, over
 * iceoryx2 with the services and settings that tipwatch_live.h states. Every message passes through here as bytes, in the
 * layout of its struct.
 *
 * Functions that return int return 0 or a number if they succeed, and a negative number if they fail. */
#ifndef TIPWATCH_CLIENT_H
#define TIPWATCH_CLIENT_H

#include <string.h>

#include "tipwatch_live.h"

/* The first fields of every message. */
struct tipwatch_head {
    uint64_t magic;
    uint64_t sequence;
    uint64_t source;
    uint64_t machine_hash;
    int64_t time_ns;
    int64_t published_ns;
};
TIPWATCH_STATIC_ASSERT(offsetof(struct tipwatch_sample, log_time_ns) == sizeof(struct tipwatch_head), "tipwatch_head");
TIPWATCH_STATIC_ASSERT(offsetof(struct tipwatch_session, total_samples) == sizeof(struct tipwatch_head), "tipwatch_head");
TIPWATCH_STATIC_ASSERT(offsetof(struct tipwatch_verdict, valid_until_ns) == sizeof(struct tipwatch_head), "tipwatch_head");

/* How messages travel. `service` is the suffix of the service name, like TIPWATCH_SAMPLE_SERVICE. */
struct tipwatch_transport {
    /* Passed to every function. */
    void *context;
    /* Publishes a message. */
    int (*send)(void *context, const char *service, const void *message, size_t size);
    /* Notifies the event service of this name. */
    int (*notify)(void *context, const char *service);
    /* Copies the next message that waits: 1 if there was one, 0 if none waits. */
    int (*receive)(void *context, const char *service, void *message, size_t size);
    /* Waits for a notification of the event service, but no longer than this (ns). */
    int (*wait)(void *context, const char *service, int64_t longest_ns);
    /* CLOCK_MONOTONIC (ns). */
    int64_t (*now_ns)(void *context);
};

/* What is wrong with a message. */
enum tipwatch_check {
    TIPWATCH_CHECK_GOOD = 0,
    /* Of another version, or no message. */
    TIPWATCH_CHECK_MAGIC = 1,
    /* Damaged. */
    TIPWATCH_CHECK_CHECKSUM = 2,
    /* Of another machine file or URDF. */
    TIPWATCH_CHECK_MACHINE = 3
};

/* CRC-32, as in zlib. */
static inline uint32_t tipwatch_crc32(const void *data, size_t size)
{
    static const uint32_t table[16] = {
        0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
        0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu, 0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu};
    const uint8_t *bytes = (const uint8_t *)data;
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        crc = (crc >> 4) ^ table[crc & 15u];
        crc = (crc >> 4) ^ table[crc & 15u];
    }
    return crc ^ 0xffffffffu;
}

/* Adds bytes and their number to a hash. */
static inline uint64_t tipwatch_hash_bytes(uint64_t hash, const void *data, size_t size)
{
    const uint8_t *bytes = (const uint8_t *)data;
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ bytes[i]) * TIPWATCH_HASH_PRIME;
    }
    for (unsigned shift = 0; shift < 64; shift += 8) {
        hash = (hash ^ (((uint64_t)size >> shift) & 0xffu)) * TIPWATCH_HASH_PRIME;
    }
    return hash;
}

/* machine_hash of the bytes of the machine file and the URDF. */
static inline uint64_t tipwatch_machine_hash(const void *machine, size_t machine_size, const void *urdf, size_t urdf_size)
{
    uint64_t hash = tipwatch_hash_bytes(TIPWATCH_HASH_START, machine, machine_size);
    return tipwatch_hash_bytes(hash, urdf, urdf_size);
}

/* Gives a message its head and checksum: the last step before it is sent. `head->magic` need not be set. */
static inline void tipwatch_seal(void *message, size_t size, const struct tipwatch_head *head)
{
    struct tipwatch_head whole = *head;
    uint64_t checksum;
    whole.magic = TIPWATCH_MAGIC;
    memcpy(message, &whole, sizeof whole);
    checksum = tipwatch_crc32(message, size - sizeof checksum);
    memcpy((uint8_t *)message + size - sizeof checksum, &checksum, sizeof checksum);
}

/* Whether a received message may be used. */
static inline enum tipwatch_check tipwatch_check_message(const void *message, size_t size, uint64_t machine_hash)
{
    struct tipwatch_head head;
    uint64_t checksum;
    memcpy(&head, message, sizeof head);
    memcpy(&checksum, (const uint8_t *)message + size - sizeof checksum, sizeof checksum);
    if (head.magic != TIPWATCH_MAGIC) {
        return TIPWATCH_CHECK_MAGIC;
    }
    if (checksum != tipwatch_crc32(message, size - sizeof checksum)) {
        return TIPWATCH_CHECK_CHECKSUM;
    }
    return head.machine_hash == machine_hash ? TIPWATCH_CHECK_GOOD : TIPWATCH_CHECK_MACHINE;
}

/* The producer of a session. Set the first three fields, and the others to zero. */
struct tipwatch_producer {
    const struct tipwatch_transport *transport;
    /* Identity of the session: a number that no other session has, such as a random one. */
    uint64_t source;
    uint64_t machine_hash;
    /* Sequence numbers of the next sample and the next announcement. */
    uint64_t next_sample;
    uint64_t next_session;
};

/* Adds a joint to a session, after those of lower streams. Fails if there are too many or the name is too long. */
static inline int tipwatch_add_joint(struct tipwatch_session *session, uint32_t stream, const char *name)
{
    size_t length = strlen(name);
    uint32_t place = session->joint_count;
    if (place >= TIPWATCH_MAX_JOINTS || length >= TIPWATCH_NAME_BYTES || stream > session->stream_count ||
        (place > 0 && stream < session->joint_streams[place - 1])) {
        return -1;
    }
    memset(session->joint_names[place], 0, sizeof session->joint_names[place]);
    memcpy(session->joint_names[place], name, length);
    session->joint_streams[place] = stream;
    session->joint_count = place + 1;
    if (stream == session->stream_count) {
        session->stream_count = stream + 1;
    }
    return 0;
}

/* Announces the session, before its first sample. */
static inline int tipwatch_announce(struct tipwatch_producer *producer, struct tipwatch_session *session)
{
    const struct tipwatch_transport *transport = producer->transport;
    struct tipwatch_head head = {0, producer->next_session, producer->source, producer->machine_hash, 0, 0};
    head.published_ns = transport->now_ns(transport->context);
    producer->next_session += 1;
    tipwatch_seal(session, sizeof *session, &head);
    return transport->send(transport->context, TIPWATCH_SESSION_SERVICE, session, sizeof *session);
}

/* Sends a sample and wakes its readers; `time_ns` is when it was measured, by the clock of the session. */
static inline int tipwatch_send(struct tipwatch_producer *producer, enum tipwatch_kind kind, uint32_t stream,
                                int64_t time_ns, const double *values, size_t count)
{
    const struct tipwatch_transport *transport = producer->transport;
    struct tipwatch_head head = {0, producer->next_sample, producer->source, producer->machine_hash, time_ns, 0};
    struct tipwatch_sample sample;
    int failed;
    if (count > TIPWATCH_MAX_VALUES) {
        return -1;
    }
    memset(&sample, 0, sizeof sample);
    sample.kind = (uint32_t)kind;
    sample.stream = stream;
    sample.value_count = (uint32_t)count;
    if (count > 0) {
        memcpy(sample.values, values, count * sizeof *values);
    }
    head.published_ns = transport->now_ns(transport->context);
    producer->next_sample += 1;
    tipwatch_seal(&sample, sizeof sample, &head);
    failed = transport->send(transport->context, TIPWATCH_SAMPLE_SERVICE, &sample, sizeof sample);
    return failed < 0 ? failed : transport->notify(transport->context, TIPWATCH_SAMPLE_SERVICE);
}

/* Ends the session. The shared memory must live until readers have read this: some 0.5 s. */
static inline int tipwatch_end(struct tipwatch_producer *producer)
{
    return tipwatch_send(producer, TIPWATCH_KIND_END, 0, 0, NULL, 0);
}

/* A consumer of verdicts. Set the first two fields, and the others to zero. */
struct tipwatch_subscriber {
    const struct tipwatch_transport *transport;
    uint64_t machine_hash;
    /* The last verdict that may be used, if has_verdict is 1. */
    struct tipwatch_verdict verdict;
    int has_verdict;
    /* The sequence number that is expected next of the source of that verdict. */
    uint64_t next;
    /* Verdicts that never arrived, arrived again or late, and were refused. */
    uint64_t lost;
    uint64_t repeated;
    uint64_t refused;
};

/* Takes one received verdict: 1 if it may be used, 0 if not. A damaged or foreign one invalidates the last. */
static inline int tipwatch_take(struct tipwatch_subscriber *subscriber, const struct tipwatch_verdict *verdict)
{
    if (tipwatch_check_message(verdict, sizeof *verdict, subscriber->machine_hash) != TIPWATCH_CHECK_GOOD) {
        subscriber->refused += 1;
        subscriber->has_verdict = 0;
        return 0;
    }
    if (subscriber->next > 0 && verdict->source == subscriber->verdict.source) {
        if (verdict->sequence < subscriber->next) {
            subscriber->repeated += 1;
            return 0;
        }
        subscriber->lost += verdict->sequence - subscriber->next;
    }
    subscriber->verdict = *verdict;
    subscriber->has_verdict = 1;
    subscriber->next = verdict->sequence + 1;
    return 1;
}

/* Takes every verdict that waits; returns how many of them may be used. */
static inline int tipwatch_poll(struct tipwatch_subscriber *subscriber)
{
    const struct tipwatch_transport *transport = subscriber->transport;
    struct tipwatch_verdict verdict;
    int taken = 0;
    for (;;) {
        int received = transport->receive(transport->context, TIPWATCH_VERDICT_SERVICE, &verdict, sizeof verdict);
        if (received <= 0) {
            return received < 0 ? received : taken;
        }
        taken += tipwatch_take(subscriber, &verdict);
    }
}

/* Waits for verdicts, but no longer than this (ns), and takes them. */
static inline int tipwatch_wait(struct tipwatch_subscriber *subscriber, int64_t longest_ns)
{
    const struct tipwatch_transport *transport = subscriber->transport;
    int failed = transport->wait(transport->context, TIPWATCH_VERDICT_SERVICE, longest_ns);
    return failed < 0 ? failed : tipwatch_poll(subscriber);
}

/* The level to act on now. TIPWATCH_LEVEL_FAULT without a valid verdict, and for a level that this header does not know. */
static inline enum tipwatch_level tipwatch_level_now(const struct tipwatch_subscriber *subscriber)
{
    const struct tipwatch_transport *transport = subscriber->transport;
    const struct tipwatch_verdict *verdict = &subscriber->verdict;
    if (!subscriber->has_verdict || transport->now_ns(transport->context) > verdict->valid_until_ns ||
        verdict->latched_level > (uint32_t)TIPWATCH_LEVEL_ASSUMED) {
        return TIPWATCH_LEVEL_FAULT;
    }
    return (enum tipwatch_level)verdict->latched_level;
}

/* The opening of a valve (-1 to 1) that a received command allows now: 0, closed, unless the command is undamaged, of this
 * machine, still valid, not held, and has such an actuator with an opening within its range. */
static inline double tipwatch_opening_now(const struct tipwatch_command *command, uint32_t actuator, uint64_t machine_hash,
                                          int64_t now_ns)
{
    const uint32_t most = sizeof command->opening / sizeof command->opening[0];
    if (tipwatch_check_message(command, sizeof *command, machine_hash) != TIPWATCH_CHECK_GOOD ||
        now_ns > command->valid_until_ns || actuator >= command->actuator_count || actuator >= most ||
        (command->mode != (uint32_t)TIPWATCH_MODE_RAMP && command->mode != (uint32_t)TIPWATCH_MODE_FOLLOW) ||
        !(command->opening[actuator] >= -1.0 && command->opening[actuator] <= 1.0)) {
        return 0.0;
    }
    return command->opening[actuator];
}

/* Sends an acknowledgement of a verdict, of these signals or, with 0, of its alarm: see the next two. */
static inline int tipwatch_send_acknowledge_of(const struct tipwatch_transport *transport, uint64_t source,
                                               uint64_t *sequence, const struct tipwatch_verdict *seen, uint64_t signals)
{
    struct tipwatch_head head = {0, *sequence, source, seen->machine_hash, 0, 0};
    struct tipwatch_acknowledge message;
    memset(&message, 0, sizeof message);
    message.verdict_source = seen->source;
    message.verdict_sequence = seen->sequence;
    message.signals = signals;
    head.published_ns = transport->now_ns(transport->context);
    *sequence += 1;
    tipwatch_seal(&message, sizeof message, &head);
    return transport->send(transport->context, TIPWATCH_ACKNOWLEDGE_SERVICE, &message, sizeof message);
}

/* Acknowledges the alarm of a verdict that somebody has seen. `source` and `sequence` number the acknowledgements of this
 * client. Fails if the verdict has no alarm. The monitor confirms it by alarm_acknowledged, or by alarm 0. */
static inline int tipwatch_send_acknowledge(const struct tipwatch_transport *transport, uint64_t source,
                                            uint64_t *sequence, const struct tipwatch_verdict *seen)
{
    return seen->alarm == 0 ? -1 : tipwatch_send_acknowledge_of(transport, source, sequence, seen, 0);
}

/* Trusts a joint again, as it is now, which a verdict that somebody has seen doubts since it jumped: its name as in the URDF.
 * Fails if the machine has no such joint, or if the verdict does not doubt it. The monitor confirms it by the joint's bit in
 * doubted, which is 0 then. */
static inline int tipwatch_send_acknowledge_joint(const struct tipwatch_transport *transport, uint64_t source,
                                                  uint64_t *sequence, const struct tipwatch_verdict *seen,
                                                  const struct tipwatch_machine *machine, const char *joint)
{
    size_t length = strlen(joint);
    uint32_t place;
    for (place = 0; place < machine->joint_count && place < TIPWATCH_MAX_JOINTS; place++) {
        if (length < TIPWATCH_NAME_BYTES && memcmp(machine->joint_names[place], joint, length + 1) == 0) {
            /* all joints from the 56th on share the last bit */
            uint64_t bit = (uint64_t)1 << (place < 55 ? 8 + place : 63);
            return (seen->doubted & bit) == 0 ? -1 : tipwatch_send_acknowledge_of(transport, source, sequence, seen, bit);
        }
    }
    return -1;
}

#endif
