//! Tests of hand-made payloads against their columns.

use std::path::Path;

use super::*;
use crate::bag::ConnectionId;

fn connection(type_name: &str, definition: &str, encoding: Encoding) -> Connection {
    Connection {
        id: ConnectionId(0),
        topic: "/t".into(),
        type_name: type_name.into(),
        definition: Some(definition.into()),
        type_hash: None,
        publisher: None,
        latching: false,
        qos: None,
        encoding,
    }
}

fn decoded(connection: &Connection, data: &[u8]) -> Result<Batch, String> {
    let (decoder, _) = Decoder::new(connection, &KnownTypes::default())?;
    let mut batch = Batch::of(decoder.columns(&["time_ns"], false));
    decoder
        .decode(data, &mut batch, 0)
        .map_err(|e| e.to_string())?;
    batch.rows = 1;
    Ok(batch)
}

/// The table as CSV.
fn csv(connection: &Connection, data: &[u8]) -> String {
    let batch = decoded(connection, data).unwrap();
    let mut rows = crate::base::csv::CsvRows::new(Vec::new(), &batch).unwrap();
    rows.write(&batch).unwrap();
    String::from_utf8(rows.finish().unwrap()).unwrap()
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
        decoded(&connection("a/T", definition, encoding), &[]).unwrap_err()
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
    let (newer, older) = Decoder::new(&connection, &KnownTypes::default()).unwrap();
    let fits = |decoder: &Decoder, lists: usize| {
        let mut batch = Batch::of(decoder.columns(&[], false));
        let mut data = vec![0, 1, 0, 0, 7, 0, 0, 0];
        data.extend(vec![0; 4 * lists]);
        decoder.decode(&data, &mut batch, 0).is_ok()
    };
    assert!(fits(&newer, 2) && !fits(&newer, 1));
    let older = older.unwrap();
    assert!(fits(&older, 1) && !fits(&older, 2));
    // The user's types take precedence over built-in ones, and may contain them.
    let mut types = KnownTypes::default();
    let mut add = |name: &str, text: &str| types.add(name, Path::new(""), Ok(text.to_owned()));
    add("my_msgs/Place", "geometry_msgs/Point32 at\nHeader header\n");
    add("my_msgs/Odd", "Pose pose\n");
    connection.type_name = "my_msgs/msg/Place".into();
    let (own, _) = Decoder::new(&connection, &types).unwrap();
    let names: Vec<_> = own.columns.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names[..3], ["at.x", "at.y", "at.z"]);
    assert_eq!(names.last(), Some(&"header.frame_id"));
    connection.type_name = "my_msgs/msg/Odd".into();
    let why = Decoder::new(&connection, &types).unwrap_err();
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
            Decoder::new(&one, &types).unwrap_or_else(|why| panic!("{name}: {why}"));
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
