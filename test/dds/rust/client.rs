// A client of `omentum dvrk --network INTERFACE` on RustDDS: homes PSM1 and moves it up by 10 mm. rust_client DOMAIN
// RustDDS finds others by multicast alone.
use ros2_client::{
    builtin_interfaces::Time,
    qos::{Durability, History, WhenFull},
    Context, ContextOptions, Message, MessageTypeName, Name, NodeName, NodeOptions, Publisher, QosProfile, Subscription,
};
use serde::{Deserialize, Serialize};
use std::{thread::sleep, time::Duration, time::Instant};

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Header {
    stamp: Time,
    frame_id: String,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct StringStamped {
    header: Header,
    string: String,
}
impl Message for StringStamped {}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct OperatingState {
    header: Header,
    state: String,
    is_homed: bool,
    is_busy: bool,
}
impl Message for OperatingState {}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct PoseStamped {
    header: Header,
    position: [f64; 3],
    orientation: [f64; 4],
}
impl Message for PoseStamped {}

fn last<M: Message + 'static>(from: &Subscription<M>, seconds: u64) -> M {
    let end = Instant::now() + Duration::from_secs(seconds);
    let mut seen = None;
    while seen.is_none() {
        assert!(Instant::now() < end, "no message");
        while let Ok(Some((message, _))) = from.take() {
            seen = Some(message);
        }
        sleep(Duration::from_millis(10));
    }
    seen.unwrap()
}

fn main() {
    let domain = std::env::args().nth(1).map_or(0, |text| text.parse().expect("a domain"));
    let context = Context::with_options(ContextOptions::new().domain_id(domain)).expect("the context");
    let name = NodeName::new("/", "rust_client").unwrap();
    let mut node = context.new_node(name, NodeOptions::new().enable_rosout(false)).expect("the node");
    let qos = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::DEFAULT)
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: 10 });
    let topic = |name: &str, package: &str, kind: &str| {
        node.create_topic(&Name::new("/PSM1", name).unwrap(), MessageTypeName::new(package, kind), &qos).expect("a topic")
    };
    let command_topic = topic("state_command", "crtk_msgs", "StringStamped");
    let state_topic = topic("operating_state", "crtk_msgs", "OperatingState");
    let pose_topic = topic("measured_cp", "geometry_msgs", "PoseStamped");
    let move_topic = topic("move_cp", "geometry_msgs", "PoseStamped");
    let command: Publisher<StringStamped> = node.create_publisher(&command_topic, None).unwrap();
    let goal: Publisher<PoseStamped> = node.create_publisher(&move_topic, None).unwrap();
    let state: Subscription<OperatingState> = node.create_subscription(&state_topic, None).unwrap();
    let pose: Subscription<PoseStamped> = node.create_subscription(&pose_topic, None).unwrap();

    let mut there = last(&pose, 20);
    println!("PSM1 is at z = {:.2} mm", 1e3 * there.position[2]);
    sleep(Duration::from_secs(1)); // until the robot knows our publishers
    let header = Header { stamp: Time::now(), frame_id: String::new() };
    command.publish(StringStamped { header, string: "home".to_string() }).expect("home");
    let mut homed = last(&state, 10);
    while !homed.is_homed {
        homed = last(&state, 10);
    }
    println!("PSM1 is {}, homed: {}", homed.state, homed.is_homed);
    let before = there.position[2];
    there.position[2] += 0.01;
    goal.publish(there).expect("move_cp");
    sleep(Duration::from_secs(2));
    let after = last(&pose, 5).position[2];
    println!("PSM1 went from z = {:.2} to {:.2} mm", 1e3 * before, 1e3 * after);
    assert!((after - before - 0.01).abs() < 0.0005, "the arm did not move by 10 mm");
}
