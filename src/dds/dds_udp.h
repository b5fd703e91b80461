// dds_udp.h: the simulated robot for programs without DDS: one JSON object in each datagram, one in each answer.
//
// | command                                    | |
// |--------------------------------------------|----------------------------------------------------------|
// | {"arm": "PSM1"}                            | only asks                                                |
// | {"arm": "PSM1", "state_command": "home"}   | as on the topic                                          |
// | {"arm": "PSM1", "servo_cp": [7 numbers]}   | x y z (m) and quaternion x y z w, in world; also move_cp |
// | {"arm": "PSM1", "servo_jp": [6 numbers]}   | rad, m; also move_jp                                     |
// | {"arm": "PSM1", "jaw": 0.1}                | rad                                                      |
// | {"arm": "PSM1", "hold": true}              | stop                                                     |
#ifndef OMENTUM_DDS_UDP_H
#define OMENTUM_DDS_UDP_H

#include "dds/dds_arm.h"
#include "omentum/base.h"

typedef enum UdpKind {
    UDP_ASK,
    UDP_STATE,
    UDP_SERVO_CP,
    UDP_MOVE_CP,
    UDP_SERVO_JP,
    UDP_MOVE_JP,
    UDP_JAW,
    UDP_HOLD
} UdpKind;

typedef struct UdpCommand {
    char arm[16];
    UdpKind kind;
    char text[32];  // of UDP_STATE
    double x[7];    // (n), as they came: not finite is for the arm to refuse
    int n;
} UdpCommand;

// @return OM_INVALID: no command; the message says why
OmStatus om__udp_parse(const char* data, size_t size, UdpCommand* command);

typedef struct Udp Udp;
// On 127.0.0.1. @return OM_OK; OM_IO (the port is taken); OM_NO_MEMORY
OmStatus om__udp_open(int port, Udp** udp);
void om__udp_close(Udp* udp);
// The next datagram; its sender is whom om__udp_answer answers. @return false: there is none
bool om__udp_take(Udp* udp, const char** data, size_t* size);
// A number of the sender of the last datagram, above 0: another one for each socket.
int om__udp_sender(const Udp* udp);
void om__udp_answer(Udp* udp, const char* data, size_t size);

// TCP on 127.0.0.1: messages for every client. What clients say is thrown away, and one that
// says more than 64 kB is dropped.
typedef struct Stream Stream;
// @return OM_OK; OM_IO (the port is taken); OM_NO_MEMORY
OmStatus om__stream_open(int port, Stream** stream);
void om__stream_close(Stream* stream);
// Clients that are connected; new ones are taken, lost ones are forgotten.
int om__stream_count(Stream* stream);
// A client that has not taken the whole last message misses this one.
// @return OM_NO_MEMORY
OmStatus om__stream_send(Stream* stream, const char* data, size_t size);
// An arm of the answer: its states and what it measures.
void om__udp_print_arm(OmJson* json, const char* name, const Arm* arm,
                       const OmArmObservation* seen);

#endif
