//! Topics of a recording, and the definitions of their messages.

/// Topic of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    Readings,
    Points,
    Truth,
    Outputs,
    TrueOutputs,
    Contact,
    Wrench,
    Events,
    Diagnostics,
    Transform,
}

/// Encoding of all messages.
pub const ENCODING: &str = "cdr";
/// Language of their definitions.
pub const LANGUAGE: &str = "ros2msg";

impl Topic {
    pub const ALL: [Self; 10] = [
        Self::Readings,
        Self::Points,
        Self::Truth,
        Self::Outputs,
        Self::TrueOutputs,
        Self::Contact,
        Self::Wrench,
        Self::Events,
        Self::Diagnostics,
        Self::Transform,
    ];

    /// Name in ROS.
    pub fn name(self) -> &'static str {
        match self {
            Self::Readings => "/taxel/readings",
            Self::Points => "/taxel/points",
            Self::Truth => "/taxel/truth",
            Self::Outputs => "/taxel/outputs",
            Self::TrueOutputs => "/taxel/true_outputs",
            Self::Contact => "/taxel/contact",
            Self::Wrench => "/taxel/wrench",
            Self::Events => "/taxel/events",
            Self::Diagnostics => "/diagnostics",
            Self::Transform => "/tf_static",
        }
    }

    /// Type of its messages.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Readings => "sensor_msgs/msg/Image",
            Self::Points | Self::Truth => "sensor_msgs/msg/PointCloud2",
            Self::Outputs | Self::TrueOutputs => "std_msgs/msg/Float64MultiArray",
            Self::Contact => "geometry_msgs/msg/PointStamped",
            Self::Wrench => "geometry_msgs/msg/WrenchStamped",
            Self::Events => "std_msgs/msg/String",
            Self::Diagnostics => "diagnostic_msgs/msg/DiagnosticArray",
            Self::Transform => "tf2_msgs/msg/TFMessage",
        }
    }

    /// What its messages hold, with the signs.
    fn description(self) -> &'static str {
        match self {
            Self::Readings => "Readings of a frame, row by row, in the unit of their columns.",
            Self::Points | Self::Truth => {
                "Electrodes at rest (x y z, in m, z up), displaced by minus dx dy dz: dz is positive where the sheet is \
                 compressed."
            }
            Self::Outputs | Self::TrueOutputs => "Outputs in the units of their columns.",
            Self::Contact => {
                "Place of a contact in m, on the sheet as it is pressed in: z is that of the highest electrodes at rest, less \
                 the depth."
            }
            Self::Wrench => {
                "Force in N with the signs of dx dy dz: z is positive for a press. Torque about the origin."
            }
            Self::Events => "What began or ended: touch, load, slip.",
            Self::Diagnostics => "Faults of wires, frames lost, novel, clamped.",
            Self::Transform => "Place of the sensor.",
        }
    }

    /// Definition of its messages, with those of all types in them.
    pub fn definition(self) -> String {
        let (fields, types): (&str, &[&str]) = match self {
            Self::Readings => (IMAGE, &[HEADER, TIME]),
            Self::Points | Self::Truth => (POINT_CLOUD, &[POINT_FIELD, HEADER, TIME]),
            Self::Outputs | Self::TrueOutputs => (MULTI_ARRAY, &[ARRAY_LAYOUT, ARRAY_DIMENSION]),
            Self::Contact => (POINT_STAMPED, &[POINT, HEADER, TIME]),
            Self::Wrench => (WRENCH_STAMPED, &[WRENCH, VECTOR, HEADER, TIME]),
            Self::Events => (STRING, &[]),
            Self::Diagnostics => (DIAGNOSTIC_ARRAY, &[DIAGNOSTIC_STATUS, KEY_VALUE, HEADER, TIME]),
            Self::Transform => {
                (TF_MESSAGE, &[TRANSFORM_STAMPED, TRANSFORM, VECTOR, QUATERNION, HEADER, TIME])
            }
        };
        let line = "=".repeat(80);
        types.iter().fold(format!("# {}\n{fields}", self.description()), |text, it| {
            text + &line + "\nMSG: " + it
        })
    }
}

const IMAGE: &str = "std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
";
const POINT_CLOUD: &str = "std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
";
const POINT_FIELD: &str = "sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
";
const MULTI_ARRAY: &str = "std_msgs/MultiArrayLayout layout
float64[] data
";
const ARRAY_LAYOUT: &str = "std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset
";
const ARRAY_DIMENSION: &str = "std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
";
const STRING: &str = "string data
";
const POINT_STAMPED: &str = "std_msgs/Header header
geometry_msgs/Point point
";
const POINT: &str = "geometry_msgs/Point
float64 x
float64 y
float64 z
";
const WRENCH_STAMPED: &str = "std_msgs/Header header
geometry_msgs/Wrench wrench
";
const WRENCH: &str = "geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
";
const VECTOR: &str = "geometry_msgs/Vector3
float64 x
float64 y
float64 z
";
const DIAGNOSTIC_ARRAY: &str = "std_msgs/Header header
diagnostic_msgs/DiagnosticStatus[] status
";
const DIAGNOSTIC_STATUS: &str = "diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
diagnostic_msgs/KeyValue[] values
";
const KEY_VALUE: &str = "diagnostic_msgs/KeyValue
string key
string value
";
const TF_MESSAGE: &str = "geometry_msgs/TransformStamped[] transforms
";
const TRANSFORM_STAMPED: &str = "geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
";
const TRANSFORM: &str = "geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
";
const QUATERNION: &str = "geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";
const HEADER: &str = "std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
";
const TIME: &str = "builtin_interfaces/Time
int32 sec
uint32 nanosec
";
