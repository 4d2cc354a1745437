//! Tests of hand-made payloads against their columns.

use std::path::Path;

use super::*;
use crate::bag::ConnectionId;
use crate::base::table::TableWriter as _;

fn connection(type_name: &str, definition: &str, encoding: Encoding) -> Connection {
    Connection {
        id: ConnectionId(0),
        topic: "/t".into(),
        type_name: type_name.into(),
        definition: Some(definition.into()),
        is_idl: definition.contains("module "),
        type_hash: None,
        publisher: None,
        latching: false,
        qos: None,
        encoding,
    }
}

fn decoded(connection: &Connection, data: &[u8]) -> Result<Batch, String> {
    decoded_by(connection, &KnownTypes::default(), data)
}

/// A payload by the first decoder that it fits.
fn decoded_by(connection: &Connection, types: &KnownTypes, data: &[u8]) -> Result<Batch, String> {
    let decoders = Decoders::new(connection, types)?;
    let batch = decoders.all.iter().find_map(|decoder| {
        let mut batch = Batch::of(decoder.columns(&["time_ns"]));
        decoder.decode(data, &mut batch, 0).ok()?;
        batch.rows = 1;
        Some(batch)
    });
    batch.ok_or(decoders.why)
}

/// The table as CSV.
fn csv(connection: &Connection, data: &[u8]) -> String {
    let batch = decoded(connection, data).unwrap();
    let mut rows = crate::base::csv::CsvRows::new(Vec::new(), &batch).unwrap();
    rows.write(&batch).unwrap();
    String::from_utf8(Box::new(rows).finish().unwrap()).unwrap()
}

#[test]
fn nested_fields_have_dotted_names_and_arrays_are_lists() {
    let definition = "time stamp\nbool FLAG=1\nPart[] parts\nfloat32[2] two\nuint8[] raw\nint8 last # end\n\
                      ===\nMSG: a/Part\nuint16 n\nstring[] names\nb/Deep deep\n===\nMSG: b/Deep\nint64 x\n";
    let mut data: Vec<u8> = Vec::new();
    data.extend([1, 0, 0, 0, 2, 0, 0, 0]);
    data.extend([2, 0, 0, 0]);
    data.extend([7, 0, 1, 0, 0, 0, 2, 0, 0, 0, b'h', b'i']);
    data.extend((-5_i64).to_le_bytes());
    data.extend([8, 0, 0, 0, 0, 0]);
    data.extend(6_i64.to_le_bytes());
    data.extend(1.5_f32.to_le_bytes());
    data.extend(f32::INFINITY.to_le_bytes());
    data.extend([3, 0, 0, 0, 9, 8, 7, 255]);
    let text = csv(&connection("a/Top", definition, Encoding::Ros1), &data);
    let expected = "stamp,parts.n,parts.names,parts.deep.x,two,raw,last\n\
                    1000000002,\"[7,8]\",\"[[\"\"hi\"\"],[]]\",\"[-5,6]\",\"[1.5,Infinity]\",\"[9,8,7]\",-1\n";
    assert_eq!(text, expected);
}

#[test]
fn idl_is_decoded_as_the_same_message() {
    let idl = "====\nIDL: b/msg/Part\nmodule b { module msg { struct Part { sequence<double> list; }; }; };\n\
               ====\nIDL: a/msg/Top\nmodule a { module msg { typedef b::msg::Part two[2]; struct Top {\n\
               builtin_interfaces::msg::Time stamp; two parts; octet last; }; }; };\n\
               ====\nIDL: builtin_interfaces/msg/Time\n\
               module builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };\n";
    let text = "builtin_interfaces/Time stamp\nb/Part[2] parts\nbyte last\n===\nMSG: b/Part\nfloat64[] list\n\
                ===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let mut data = vec![0, 1, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    data.extend(2.5_f64.to_le_bytes());
    data.extend([0, 0, 0, 0, 9]);
    let of = |text| csv(&connection("a/msg/Top", text, Encoding::Cdr), &data);
    assert_eq!(of(idl), of(text));
    assert!(of(idl).contains("5000000006"), "{}", of(idl));
    let union = "module a { struct b { long c; }; union d { }; };";
    let why = decoded(&connection("a/b", union, Encoding::Cdr), &data).unwrap_err();
    assert!(why.contains("unexpected `union d`"), "{why}");
}

#[test]
fn common_types_are_those_of_the_connections_ros() {
    let mut data = vec![3, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0, 1, 0, 0, 0, b'x'];
    data.extend([0; 24]);
    let point = connection("geometry_msgs/PointStamped", "", Encoding::Ros1);
    assert!(csv(&point, &data).starts_with("header.seq,header.stamp,"));
    let cdr = connection("geometry_msgs/msg/PointStamped", "", Encoding::Cdr);
    let mut data = vec![
        0, 1, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0, 2, 0, 0, 0, b'x', 0, 0, 0,
    ];
    data.extend([0; 24]);
    assert!(csv(&cdr, &data).starts_with("header.stamp,header.frame_id,"));
}

#[test]
fn cdr_is_aligned_and_an_empty_message_is_a_byte() {
    let definition = "b/Nothing nothing\nfloat64[] list\nuint8 last\n===\nMSG: b/Nothing\n";
    let little = [
        0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 5,
    ];
    let big = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0x3f, 0xf0, 0, 0, 0, 0, 0, 0, 5,
    ];
    for data in [little, big] {
        let text = csv(&connection("b/msg/Top", definition, Encoding::Cdr), &data);
        assert_eq!(text, "list,last\n[1],5\n");
    }
}

#[test]
fn a_field_with_a_reserved_name_gets_a_suffix() {
    let batch = decoded(
        &connection("a/T", "int8 time_ns\nint8 time_ns\n", Encoding::Ros1),
        &[1, 2],
    );
    let names: Vec<_> = batch.unwrap().columns.into_iter().map(|c| c.name).collect();
    assert_eq!(names, ["time_ns_", "time_ns__"]);
}

#[test]
fn undecodable_messages_report_the_reason() {
    let why = |definition: &str, encoding| {
        decoded(&connection("a/T", definition, encoding), &[1]).unwrap_err()
    };
    assert!(why("", Encoding::Ros1).contains("no definition"));
    assert!(why("X x\n", Encoding::Ros1).contains("lacks the type `X`"));
    assert!(why("T t\n===\nMSG: a/T\nT t\n", Encoding::Ros1).contains("contains itself"));
    assert!(why("int8 x\n", Encoding::Other("json".to_owned())).contains("`json`"));
    assert!(
        why(
            "module a { struct T { map<long, long> x; }; };",
            Encoding::Cdr
        )
        .contains("IDL")
    );
}

#[test]
fn common_types_need_no_definition_in_either_version() {
    // `shape_msgs/SolidPrimitive` ends in a polygon since Humble.
    let mut connection = connection("shape_msgs/msg/SolidPrimitive", "", Encoding::Cdr);
    connection.definition = None;
    let [newer, older] = &Decoders::new(&connection, &KnownTypes::default())
        .unwrap()
        .all[..]
    else {
        panic!("two decoders");
    };
    let fits = |decoder: &Decoder, lists: usize| {
        let mut batch = Batch::of(decoder.columns(&[]));
        let mut data = vec![0, 1, 0, 0, 7, 0, 0, 0];
        data.extend(vec![0; 4 * lists]);
        decoder.decode(&data, &mut batch, 0).is_ok()
    };
    assert!(fits(newer, 2) && !fits(newer, 1));
    assert!(fits(older, 1) && !fits(older, 2));
    // The user's types take precedence over built-in ones, and may contain them.
    let mut types = KnownTypes::default();
    let mut add = |name: &str, text: &str| types.add(name, Path::new(""), Ok(text.to_owned()));
    add("my_msgs/Place", "geometry_msgs/Point32 at\nHeader header\n");
    add("my_msgs/Odd", "Pose pose\n");
    connection.type_name = "my_msgs/msg/Place".into();
    let own = &Decoders::new(&connection, &types).unwrap().all[0];
    let names: Vec<_> = own.columns.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names[..3], ["at.x", "at.y", "at.z"]);
    assert_eq!(names.last(), Some(&"header.frame_id"));
    connection.type_name = "my_msgs/msg/Odd".into();
    let why = Decoders::new(&connection, &types).unwrap_err();
    assert!(
        why.contains("lacks the type `Pose`"),
        "not another package's"
    );
}

#[test]
fn every_carried_type_is_complete() {
    let types = KnownTypes::default();
    for (carried, encoding) in [
        (Carried::Ros1, Encoding::Ros1),
        (Carried::Ros2, Encoding::Cdr),
    ] {
        let all = types.all(carried);
        assert!(all.len() > 120);
        for message in all {
            let name = format!("{}/msg/{}", message.package, message.name);
            let mut one = connection(&name, "", encoding.clone());
            one.definition = None;
            Decoders::new(&one, &types).unwrap_or_else(|why| panic!("{name}: {why}"));
        }
    }
}

#[test]
fn hostile_payloads_are_rejected_early() {
    let fails = |definition: &str, data: &[u8]| {
        decoded(&connection("a/T", definition, Encoding::Ros1), data).is_err()
    };
    assert!(fails("float64[] x\n", &[255, 255, 255, 255]));
    assert!(fails("float64[4294967295] x\n", &[0; 64]));
    assert!(fails("int8 x\n", &[1, 2]), "bytes are left");
    // Many empty elements: skipped at once, not one by one.
    let nothing = "E[] e\n===\nMSG: a/E\nF[100] f\n===\nMSG: a/F\n";
    let mut data = vec![0; 1 << 20];
    data[..4].copy_from_slice(&(1_u32 << 19).to_le_bytes());
    assert!(fails(nothing, &data));
    // A definition that doubles on every level.
    let level = |k: u32| format!("===\nMSG: a/L{k}\nL{0} a\nL{0} b\n", k + 1);
    let doubling: Vec<String> = (0..20).map(level).collect();
    let doubling = doubling.concat();
    assert!(fails(&format!("L0 x\n{doubling}"), &[]));
}

const STAMPED: &str = "# A pose
Header header
Pose pose # in some frame

================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Pose
Point position
Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";

#[test]
fn a_definition_cut_anywhere_is_completed() {
    let mut data = vec![3, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0, 1, 0, 0, 0, b'x'];
    data.extend(
        [1.0_f64, 2.0, 3.0, 0.0, 0.5, 0.0, 1.0]
            .map(f64::to_le_bytes)
            .concat(),
    );
    let of = |type_name: &str, text: &str, data: &[u8]| {
        csv(&connection(type_name, text, Encoding::Ros1), data)
    };
    let whole = of("geometry_msgs/PoseStamped", STAMPED, &data);
    assert!(
        whole.contains("header.seq,") && whole.contains(",5000000006,x,1,2,3,"),
        "{whole}"
    );
    for cut in 0..STAMPED.len() {
        let found = of("geometry_msgs/PoseStamped", &STAMPED[..cut], &data);
        assert_eq!(found, whole, "{}", &STAMPED[..cut]);
    }
    // Of a type that is not known, what is left of the outermost message counts; other packages' types are not guessed.
    let text = STAMPED.replace("Pose pose", "geometry_msgs/Pose pose");
    let fields = text.find("\n\n").unwrap();
    for cut in fields..text.len() {
        assert_eq!(
            of("my_msgs/Place", &text[..cut], &data),
            whole,
            "{}",
            &text[..cut]
        );
    }
    let other = connection(
        "my_msgs/Place",
        "Header header\nPose pose\n",
        Encoding::Ros1,
    );
    let why = decoded(&other, &data).unwrap_err();
    assert_eq!(
        why,
        "its definition lacks the type `Pose`; `--msg-path` adds it"
    );
}

#[test]
fn a_bare_header_is_that_of_std_msgs() {
    let ros1 = "Header header\nInner inner\n===\nMSG: a/Header\nuint8 own\n===\nMSG: a/Inner\nHeader header\na/Header other\n";
    let header = [1, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0, 1, 0, 0, 0, b'x'];
    let data = [&header[..], &header, &[9]].concat();
    let expected = "header.seq,header.stamp,header.frame_id,inner.header.seq,inner.header.stamp,inner.header.frame_id,inner.other.own\n\
                    1,5000000006,x,1,5000000006,x,9\n";
    for text in [
        ros1.to_owned(),
        format!("{ros1}===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"),
    ] {
        assert_eq!(
            csv(&connection("a/T", &text, Encoding::Ros1), &data),
            expected
        );
    }
    // In ROS 2 it is that of the same package.
    let text = csv(
        &connection(
            "a/msg/T",
            "Header header\n===\nMSG: a/Header\nuint8 own\n",
            Encoding::Cdr,
        ),
        &[0, 1, 0, 0, 9],
    );
    assert_eq!(text, "header.own\n9\n");
}

#[test]
fn messages_without_fields_are_rows() {
    for (text, encoding, data) in [
        ("", Encoding::Ros1, &b""[..]),
        ("# nothing\n", Encoding::Ros1, b""),
        ("int8 A=1\nstring B=\"x y\"#z\n", Encoding::Ros1, b""),
        ("", Encoding::Cdr, b"\0\x01\0\0\0"),
        ("", Encoding::Cdr, b"\0\x01\0\0\0\0\0\0"),
        ("", Encoding::Cdr, b"\0\x01\0\0"),
    ] {
        let batch = decoded(&connection("a/Ping", text, encoding), data).unwrap();
        assert_eq!((batch.columns.len(), batch.rows), (0, 1), "{text}");
    }
    // An empty text may also mean that the definition is unknown.
    let why =
        |connection: &Connection| decoded(connection, b"\0\x01\0\0\x05\0\0\0\x07").unwrap_err();
    let mut unknown = connection("a/Ping", "", Encoding::Cdr);
    assert_eq!(
        why(&unknown),
        "the bag contains no definition of its type; `--msg-path` adds it"
    );
    unknown.definition = None;
    assert!(decoded(&unknown, b"\0\x01\0\0\0").is_err());
}

#[test]
fn arrays_of_messages_without_bytes_are_decoded() {
    let text =
        "E[3] three\nE[] any\nZ[] none\nuint8 last\n===\nMSG: a/E\n===\nMSG: a/Z\nfloat64[0] x\n";
    let data = [2, 0, 0, 0, 1, 0, 0, 0, 7];
    let found = csv(&connection("a/T", text, Encoding::Ros1), &data);
    assert_eq!(found, "none.x,last\n[[]],7\n");
    let data = [
        0, 1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 7,
    ];
    assert_eq!(
        csv(&connection("a/T", text, Encoding::Cdr), &data),
        "none.x,last\n[[]],7\n"
    );
}

#[test]
fn bounds_and_texts_of_constants_are_no_fields() {
    let text = "string<=10 name \"a = b\"\nstring A=\"# MSG: x\"\nstring B = c\nuint8[<=4] raw\nstring<=3[<=2] words\n\
                int32 n 5\nint32 M  =  6\n";
    let data = b"\0\x01\0\0\x02\0\0\0x\0\0\0\x01\0\0\0\x09\0\0\0\0\0\0\0\x07\0\0\0";
    assert_eq!(
        csv(&connection("a/msg/T", text, Encoding::Cdr), data),
        "name,raw,words,n\nx,[9],[],7\n"
    );
    let why = decoded(&connection("a/msg/T", "wstring w\n", Encoding::Cdr), data).unwrap_err();
    assert_eq!(why, "wide strings are not decoded");
}

#[test]
fn sections_are_read_in_their_own_form() {
    // As rosbag2 writes a service with a dependency that is only in IDL.
    let text = "====\nSRV: a/srv/Go\nb/Point to\n---\nstring why\n\n====\nIDL: b/msg/Point\nmodule b { module msg {\n\
                const long N = 2; enum Kind { A, B };\nstruct Point { Kind kind; double x[N]; }; }; };\n";
    let names = |type_name: &str| {
        let mut one = connection(type_name, text, Encoding::Cdr);
        one.is_idl = true;
        let decoders = Decoders::new(&one, &KnownTypes::default());
        decoders.map(|found| {
            found.all[0]
                .columns
                .iter()
                .map(|(name, ..)| name.clone())
                .collect::<Vec<_>>()
        })
    };
    assert_eq!(names("a/srv/Go_Request").unwrap(), ["to.kind", "to.x"]);
    assert_eq!(names("a/srv/Go_Response").unwrap(), ["why"]);
    let event = names("a/srv/Go_Event").unwrap();
    assert_eq!(
        event[..4],
        [
            "info.event_type",
            "info.stamp",
            "info.client_gid",
            "info.sequence_number"
        ]
    );
    assert_eq!(
        event[4..],
        ["request.to.kind", "request.to.x", "response.why"]
    );
    // The parts of a service may be empty, in CDR one byte each.
    let empty = connection(
        "a/srv/Ping_Event",
        "====\nSRV: a/srv/Ping\n---\n",
        Encoding::Cdr,
    );
    let mut data = vec![0, 1, 0, 0, 1, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0];
    data.extend([7; 16]);
    data.extend([0; 4]);
    data.extend([1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let found = csv(&empty, &data);
    assert!(found.starts_with("info.event_type,info.stamp,"), "{found}");
    // The text of an action says nothing about other types.
    let other = connection(
        "a/msg/Other",
        "====\nACTION: a/action/Do\nint8 x\n---\n---\n",
        Encoding::Cdr,
    );
    assert_eq!(
        decoded(&other, &data).unwrap_err(),
        "its definition is that of other types; `--msg-path` replaces it"
    );
}

#[test]
fn payloads_in_other_forms_of_cdr_are_named() {
    let decoder = &Decoders::new(
        &connection("a/T", "int8 x\n", Encoding::Cdr),
        &KnownTypes::default(),
    )
    .unwrap()
    .all[0];
    let name = |kind: u8| decoder.other_encoding(&[0, kind, 0, 0, 1]);
    assert_eq!((name(0), name(1)), (None, None));
    assert_eq!(
        (name(2), name(3)),
        (Some("a parameter list (PL_CDR)"), name(2))
    );
    assert!(
        [6, 7, 8, 9, 10, 11, 16, 17, 20, 21]
            .iter()
            .all(|kind| name(*kind) == Some("XCDR2"))
    );
    let ros1 = &Decoders::new(
        &connection("a/T", "int8 x\n", Encoding::Ros1),
        &KnownTypes::default(),
    )
    .unwrap()
    .all[0];
    assert_eq!(ros1.other_encoding(&[0, 7]), None);
}
