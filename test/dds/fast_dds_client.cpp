// fast_dds_client.cpp: a client of omentum dvrk on eProsima's Fast DDS, the middleware of ROS 2's rmw_fastrtps.
//
//     fast_dds_client DOMAIN
//
// Types are those that fastddsgen makes of dds_types.idl. Reads poses, states and a cloud of the robot; homes PSM1 and
// sends it 3 mm down by move_cp. Exit code 0 and one line: both directions work.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include "dds_typesPubSubTypes.h"

using namespace eprosima::fastdds::dds;
using Pose = geometry_msgs::msg::dds_::PoseStamped_;
using State = crtk_msgs::msg::dds_::OperatingState_;
using Words = crtk_msgs::msg::dds_::StringStamped_;
using Cloud = sensor_msgs::msg::dds_::PointCloud2_;

static DomainParticipant* participant;
static Publisher* publisher;
static Subscriber* subscriber;

[[noreturn]] static void fail(const std::string& why) {
    std::printf("fast_dds_client: %s\n", why.c_str());
    std::exit(1);
}

// Of this machine alone, by loopback and without multicast, as omentum has it by default.
static DomainParticipantQos local_qos() {
    DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    udp->maxInitialPeersRange = 40;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    eprosima::fastrtps::rtps::Locator_t peer;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    return qos;
}

template <class PubSubType> static Topic* make_topic(const char* name) {
    TypeSupport type(new PubSubType());
    type.register_type(participant);
    Topic* topic = participant->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT);
    if (!topic) fail(std::string("no topic ") + name);
    return topic;
}

template <class PubSubType> static DataReader* read(const char* name, bool is_latched = false) {
    DataReaderQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = is_latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    return subscriber->create_datareader(make_topic<PubSubType>(name), qos);
}

template <class PubSubType> static DataWriter* write(const char* name) {
    DataWriterQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = VOLATILE_DURABILITY_QOS;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    return publisher->create_datawriter(make_topic<PubSubType>(name), qos);
}

// The next message, at most 20 s.
template <class Message> static Message next(DataReader* reader, const char* what) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < end) {
        Message message;
        SampleInfo info;
        if (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
            if (info.valid_data) return message;
        } else
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    fail(std::string("no message: ") + what);
}

static void wait_for_reader(DataWriter* writer, const char* what) {
    PublicationMatchedStatus status;
    for (int i = 0; i < 2000; ++i) {
        writer->get_publication_matched_status(status);
        if (status.current_count > 0) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    fail(std::string("the robot does not read ") + what);
}

int main(int argc, char** argv) {
    if (argc != 2) fail("usage: fast_dds_client DOMAIN");
    participant = DomainParticipantFactory::get_instance()->create_participant(
        static_cast<uint32_t>(std::atoi(argv[1])), local_qos());
    if (!participant) fail("no participant");
    publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);

    DataReader* measured =
        read<geometry_msgs::msg::dds_::PoseStamped_PubSubType>("rt/PSM1/measured_cp");
    DataReader* state =
        read<crtk_msgs::msg::dds_::OperatingState_PubSubType>("rt/PSM1/operating_state", true);
    DataReader* points = read<sensor_msgs::msg::dds_::PointCloud2_PubSubType>("rt/depth/points");
    DataWriter* command =
        write<crtk_msgs::msg::dds_::StringStamped_PubSubType>("rt/PSM1/state_command");
    DataWriter* move = write<geometry_msgs::msg::dds_::PoseStamped_PubSubType>("rt/PSM1/move_cp");

    Pose goal = next<Pose>(measured, "measured_cp");
    const double from = goal.pose().position().z();
    const Cloud cloud = next<Cloud>(points, "depth/points");
    if (cloud.data().size() != static_cast<size_t>(cloud.row_step()) * cloud.height() ||
        cloud.fields().size() != 4)
        fail("the cloud has another size than its rows");
    if (next<State>(state, "operating_state").is_homed()) fail("the arm is homed before \"home\"");
    wait_for_reader(command, "state_command");
    wait_for_reader(move, "move_cp");
    Words words;
    words.text("home");
    command->write(&words);
    while (!next<State>(state, "operating_state after home").is_homed()) continue;
    goal.pose().position().z(from - 0.003);
    move->write(&goal);
    double z = from;
    for (int i = 0; i < 1000 && std::fabs(z - from + 0.003) > 5e-4; ++i)
        z = next<Pose>(measured, "measured_cp after move_cp").pose().position().z();
    if (std::fabs(z - from + 0.003) > 5e-4) fail("the arm does not go where it was sent");
    std::printf("Fast DDS: %u x %u points; PSM1 went from z = %.1f to %.1f mm\n", cloud.width(),
                cloud.height(), 1e3 * from, 1e3 * z);
    return 0;
}
