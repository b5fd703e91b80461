// dds_udp.c: sockets of this machine: datagrams, and a stream for clients that watch.
#include "dds/dds_udp.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define MAX_DATAGRAM 4096

struct Udp {
    int fd;
    struct sockaddr_in from;  // of the last datagram
    char data[MAX_DATAGRAM];
};

OmStatus om__udp_open(int port, Udp** udp) {
    const struct sockaddr_in at = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)port),
                                   .sin_addr = {htonl(INADDR_LOOPBACK)}};
    *udp = NULL;
    Udp* u = om_calloc(1, sizeof *u);
    if (!u) return OM_NO_MEMORY;
    u->fd = socket(AF_INET, SOCK_DGRAM, 0);
    if (u->fd < 0 || bind(u->fd, (const struct sockaddr*)&at, sizeof at) != 0) {
        const OmStatus status = om_error(OM_IO, "UDP port %d: %s", port, strerror(errno));
        om__udp_close(u);
        return status;
    }
    *udp = u;
    return OM_OK;
}

void om__udp_close(Udp* udp) {
    if (!udp) return;
    if (udp->fd >= 0) close(udp->fd);
    om_free(udp);
}

bool om__udp_take(Udp* udp, const char** data, size_t* size) {
    socklen_t length = sizeof udp->from;
    const ssize_t n = recvfrom(udp->fd, udp->data, sizeof udp->data, MSG_DONTWAIT,
                               (struct sockaddr*)&udp->from, &length);
    *data = udp->data;
    *size = n > 0 ? (size_t)n : 0;
    return n >= 0;
}

int om__udp_sender(const Udp* udp) { return ntohs(udp->from.sin_port); }

// A client that is gone is no error.
void om__udp_answer(Udp* udp, const char* data, size_t size) {
    (void)sendto(udp->fd, data, size, MSG_DONTWAIT, (const struct sockaddr*)&udp->from,
                 sizeof udp->from);
}

// ---- the stream ---------------------------------------------------------------------------------------------------

enum {
    MAX_CLIENT = 8,
    MAX_READ = 16,      // of 1024 bytes each, of a client in om__stream_count
    MAX_HEARD = 65536,  // bytes: a client that watches says less
};

typedef struct Client {
    int fd;  // -1: none
    char* data;
    size_t size, sent, capacity, heard;
} Client;

struct Stream {
    int fd;
    Client client[MAX_CLIENT];
};

static void set_nonblocking(int fd) { fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK); }

OmStatus om__stream_open(int port, Stream** stream) {
    const struct sockaddr_in at = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)port),
                                   .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const int yes = 1;
    *stream = NULL;
    Stream* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    for (int k = 0; k < MAX_CLIENT; ++k) s->client[k].fd = -1;
    s->fd = socket(AF_INET, SOCK_STREAM, 0);
    bool is_good = s->fd >= 0;
    if (is_good) setsockopt(s->fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    is_good = is_good && bind(s->fd, (const struct sockaddr*)&at, sizeof at) == 0 &&
              listen(s->fd, MAX_CLIENT) == 0;
    if (!is_good) {
        const OmStatus status = om_error(OM_IO, "TCP port %d: %s", port, strerror(errno));
        om__stream_close(s);
        return status;
    }
    set_nonblocking(s->fd);
    *stream = s;
    return OM_OK;
}

static void drop(Client* c) {
    if (c->fd >= 0) close(c->fd);
    c->fd = -1;
    c->size = c->sent = c->heard = 0;
}

void om__stream_close(Stream* stream) {
    if (!stream) return;
    for (int k = 0; k < MAX_CLIENT; ++k) {
        drop(&stream->client[k]);
        om_free(stream->client[k].data);
    }
    if (stream->fd >= 0) close(stream->fd);
    om_free(stream);
}

// Send on what the socket takes.
static void flush_client(Client* c) {
    while (c->fd >= 0 && c->sent < c->size) {
        const ssize_t n =
            send(c->fd, c->data + c->sent, c->size - c->sent, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
        if (n <= 0)
            drop(c);
        else
            c->sent += (size_t)n;
    }
}

// So much and no more: a client that sends without end must not keep the robot from its next tick.
static void read_away(Client* c) {
    char bytes[1024];
    ssize_t n = 1;
    for (int k = 0; k < MAX_READ && n > 0; ++k) {
        n = recv(c->fd, bytes, sizeof bytes, MSG_DONTWAIT);
        if (n > 0) c->heard += (size_t)n;
    }
    const bool is_gone = n == 0 || (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK);
    if (is_gone || c->heard > MAX_HEARD) drop(c);
}

int om__stream_count(Stream* stream) {
    int n = 0;
    for (int k = 0; k < MAX_CLIENT; ++k) {
        Client* c = &stream->client[k];
        if (c->fd < 0) {
            c->fd = accept(stream->fd, NULL, NULL);
            if (c->fd >= 0) set_nonblocking(c->fd);
        }
        if (c->fd >= 0) read_away(c);
        flush_client(c);
        n += c->fd >= 0;
    }
    return n;
}

OmStatus om__stream_send(Stream* stream, const char* data, size_t size) {
    for (int k = 0; k < MAX_CLIENT; ++k) {
        Client* c = &stream->client[k];
        flush_client(c);
        if (c->fd < 0 || c->sent < c->size) continue;
        if (size > c->capacity) {
            om_free(c->data);
            c->data = om_alloc(size, 1);
            c->capacity = c->data ? size : 0;
            c->size = c->sent = 0;
            if (!c->data) return OM_NO_MEMORY;
        }
        memcpy(c->data, data, size);
        c->size = size;
        c->sent = 0;
        flush_client(c);
    }
    return OM_OK;
}
