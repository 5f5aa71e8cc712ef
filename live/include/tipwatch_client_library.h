/* Functions of libtipwatch_client.so, for C (C11) and C++ (C++11): the transport of tipwatch_client.h over the shared memory
 * of tipwatch-live. The library has nothing but that: messages are made, sent, taken and checked by the functions of
 * tipwatch_client.h, whose transport tipwatch_client_transport() gives.
 *
 *     cc -std=c11 client.c $(pkg-config --cflags --libs tipwatch_client) -lm -o client
 *
 * ENDS. A client opens its end of a service when it first uses it, which takes some milliseconds; and up to 1 s where the only
 * place for a writer is taken, such as by another machine of this name. Announcing a session opens that of samples, too.
 * Verdicts are kept for a reader from its first receive or wait on: call tipwatch_poll once before the session. All memory
 * that a writer may ever touch is reserved then: the shared memory that is full is an error there, never a signal later.
 *
 * THREADS. A client belongs to the thread that opened it: from another one its functions fail, and do nothing. Each thread may
 * open a client of its own. tipwatch_client_now_ns may be called from everywhere. No function may be called from a signal
 * handler. After a fork the clients stay with the parent: with those the child's calls fail with TIPWATCH_CLIENT_THREAD, and do
 * nothing.
 *
 * TIME. Nothing but tipwatch_client_wait waits. A signal may end it early; the kernel rounds its time up, by up to two of its
 * ticks (8 ms where it has 250 in a second). The library handles no signals.
 *
 * ERRORS. Functions that return int return 0 or a number if they succeed, a number of enum tipwatch_client_failure if they
 * fail; tipwatch_client_error has the text. After a failure everything may be called again, but after
 * TIPWATCH_CLIENT_MISTAKE only tipwatch_client_close. */
#ifndef TIPWATCH_CLIENT_LIBRARY_H
#define TIPWATCH_CLIENT_LIBRARY_H

#include "tipwatch_client.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Why a call failed. -1 is left to the functions of tipwatch_client.h. */
enum tipwatch_client_failure {
    /* A pointer is null that must not be, or a text is no UTF-8. */
    TIPWATCH_CLIENT_ARGUMENT = -2,
    /* No service has this suffix, or the service has no events to notify and wait for. */
    TIPWATCH_CLIENT_SERVICE = -3,
    /* The size is not that of the messages of this service. */
    TIPWATCH_CLIENT_SIZE = -4,
    /* Another thread has opened the client, or the process before a fork. */
    TIPWATCH_CLIENT_THREAD = -5,
    /* The shared memory is full. */
    TIPWATCH_CLIENT_ROOM = -6,
    /* The shared memory fails: the place of the writer is taken, there are too many readers, or files cannot be used. */
    TIPWATCH_CLIENT_SHARED_MEMORY = -7,
    /* The library has a mistake. The client can only be closed. */
    TIPWATCH_CLIENT_MISTAKE = -8,
    /* The client is closed already, or was never open. */
    TIPWATCH_CLIENT_CLOSED = -9
};

/* A process that has joined the shared memory. The pointer is a number that no other client of the process ever has: with that of a
 * closed one every function fails with TIPWATCH_CLIENT_CLOSED, and does nothing. */
struct tipwatch_client;

/* Joins the shared memory. `contract` is TIPWATCH_CONTRACT: a library with other messages refuses. `service` is the common name
 * of the services, as of --service, and not empty; `prefix` that of all files, as of --prefix; NULL for the default of each.
 * NULL if it fails: then `error`, if it is not NULL, has the reason as text (UTF-8), cut to `error_size` bytes with the zero at
 * its end. */
struct tipwatch_client *tipwatch_client_open(uint64_t contract, const char *service, const char *prefix, char *error,
                                             size_t error_size);

/* Leaves the shared memory; does nothing with NULL. Messages that a reader has not read are lost: after the end of a session wait
 * some 0.5 s. Fails from another thread, where the client stays open, and with a client that is closed already. */
int tipwatch_client_close(struct tipwatch_client *client);

/* Why the last call that failed with this client did (UTF-8), until the next call with it; empty before. */
const char *tipwatch_client_error(const struct tipwatch_client *client);

/* The functions of the transport: `context` is the client. */
int tipwatch_client_send(void *context, const char *service, const void *message, size_t size);
int tipwatch_client_notify(void *context, const char *service);
int tipwatch_client_receive(void *context, const char *service, void *message, size_t size);
int tipwatch_client_wait(void *context, const char *service, int64_t longest_ns);
int64_t tipwatch_client_now_ns(void *context);

#ifdef __cplusplus
}
#endif

/* The transport over a client, for as long as that is open. */
static inline struct tipwatch_transport tipwatch_client_transport(struct tipwatch_client *client)
{
    struct tipwatch_transport transport;
    transport.context = client;
    transport.send = tipwatch_client_send;
    transport.notify = tipwatch_client_notify;
    transport.receive = tipwatch_client_receive;
    transport.wait = tipwatch_client_wait;
    transport.now_ns = tipwatch_client_now_ns;
    return transport;
}

#endif
