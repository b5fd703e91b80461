// dds_udp.c: datagrams of this machine.
#include "dds/dds_udp.h"

#include <arpa/inet.h>
#include <errno.h>
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

// A client that is gone is no error.
void om__udp_answer(Udp* udp, const char* data, size_t size) {
    (void)sendto(udp->fd, data, size, MSG_DONTWAIT, (const struct sockaddr*)&udp->from,
                 sizeof udp->from);
}
