// dds_tape.h: the recording of a robot whose arms must not wait for a disk: a queue in front of dds_mcap.h, and a
// thread that writes.
//
//     om__tape_open("run.mcap", &tape);
//     om__tape_add(tape, &(McapTopic){"tf", LINK_TF, 10, false, hash}, &channel);
//     om__tape_write(tape, channel, time, cdr, size);
//     om__tape_close(tape);
#ifndef OMENTUM_DDS_TAPE_H
#define OMENTUM_DDS_TAPE_H

#include "dds/dds_mcap.h"

#define TAPE_MOST ((size_t)256 << 20)  // bytes that wait for the disk

// A new file. @return OM_IO: it is there already, or cannot be written; OM_UNAVAILABLE: no thread; OM_NO_MEMORY
OmStatus om__tape_open(const char* path, Tape** tape);
// The channel of a topic; -1: its type is not recorded. It may wait for the disk.
OmStatus om__tape_add(Tape* tape, const McapTopic* topic, int* channel);
// A message with its four bytes of encapsulation, at `time` (s). From any thread; it does not wait for the disk.
// @return OM_NO_MEMORY; OM_IO: an earlier message could not be written, or more than TAPE_MOST would wait
OmStatus om__tape_write(Tape* tape, int channel, double time, const void* cdr, size_t size);
// Write what waits, and free. Null is allowed. @return the first error of the thread that writes
OmStatus om__tape_close(Tape* tape);
// For tests: bytes that may wait, and a function that the thread that writes calls before it writes.
void om__tape_hinder(Tape* tape, size_t most, void (*fn)(void* ctx), void* ctx);

#endif
