// dds_mcap.h: a recording of topics as rosbag2 reads it: MCAP, profile "ros2", messages in CDR. No DDS here, one
// thread; it waits for the disk.
//
//     om__mcap_open("run.mcap", &mcap);
//     om__mcap_add(mcap, &(McapTopic){"tf", LINK_TF, 10, false, hash}, &channel);
//     om__mcap_write(mcap, channel, time, cdr, size);
//     om__mcap_close(mcap);
#ifndef OMENTUM_DDS_MCAP_H
#define OMENTUM_DDS_MCAP_H

#include "dds/dds_link.h"

typedef struct McapTopic {
    const char* name;  // without the slash in front
    LinkType type;
    int depth;  // of the writer's queue
    bool is_latched;
    const char* hash;  // of the type, "RIHS01_..."
} McapTopic;

// A new file. @return OM_IO: it is there already, or cannot be written
OmStatus om__mcap_open(const char* path, Mcap** mcap);
// The channel of a topic; -1: its type is not recorded (om__mcap_schema has none).
OmStatus om__mcap_add(Mcap* mcap, const McapTopic* topic, int* channel);
// A message with its four bytes of encapsulation, at `time` (s). @return OM_IO: the disk
OmStatus om__mcap_write(Mcap* mcap, int channel, double time, const void* cdr, size_t size);
// Write what is left, and free. Null is allowed.
OmStatus om__mcap_close(Mcap* mcap);
// The sum by which a chunk is checked.
uint32_t om__mcap_crc(const void* data, size_t size);
// ROS 2's name of a type, "sensor_msgs/msg/Image", and its definition with those it uses; null: none.
const char* om__mcap_type_name(LinkType type);
const char* om__mcap_schema(LinkType type);

#endif
