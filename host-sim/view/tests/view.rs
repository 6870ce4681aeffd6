//! The view over its socket: who is served, what is bounded, and what the page is told.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use taxel_view::message::{Channel, Contact, Flag};
use taxel_view::{Action, Frame, Layout, Status, View};

const TOKEN: &str = "0123456789abcdef";

fn start() -> (View, std::sync::mpsc::Receiver<taxel_view::Command>, u16) {
    let (view, commands) = View::start(0, Some(TOKEN)).expect("a free port");
    let address = view.address();
    let port = address.split(['/', ':']).nth(4).and_then(|port| port.parse().ok());
    (view, commands, port.expect("a port"))
}

fn connect(port: u16) -> TcpStream {
    let stream = TcpStream::connect(("127.0.0.1", port)).expect("a server");
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout");
    stream
}

/// Everything that is answered to `request`.
fn answer(port: u16, request: &str) -> String {
    let mut stream = connect(port);
    stream.write_all(request.as_bytes()).expect("written");
    let mut text = String::new();
    let _ = stream.read_to_string(&mut text);
    text
}

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or_default()
}

fn get(port: u16, target: &str, headers: &str) -> String {
    answer(port, &format!("GET {target} HTTP/1.1\r\n{headers}\r\n"))
}

fn post(port: u16, headers: &str, body: &str) -> String {
    let length = body.len();
    answer(
        port,
        &format!(
            "POST /command?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n{headers}Content-Length: {length}\r\n\r\n{body}"
        ),
    )
}

/// Events of a new viewer until `enough` of them have come.
fn events(port: u16, enough: impl Fn(&str) -> bool) -> String {
    let mut stream = connect(port);
    write!(stream, "GET /events?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n\r\n")
        .expect("written");
    let (mut text, mut byte) = (Vec::new(), [0]);
    while !enough(&String::from_utf8_lossy(&text)) {
        // Up to the end of an event.
        while !text.ends_with(b"\n\n") || byte == [0] {
            stream.read_exact(&mut byte).expect("events");
            text.push(byte[0]);
        }
        byte = [0];
    }
    String::from_utf8(text).expect("text")
}

#[test]
fn only_this_machine_with_the_token_is_served() {
    let (_view, _commands, port) = start();
    let page = format!("/?token={TOKEN}");
    for host in ["127.0.0.1:5", "localhost", "[::1]:80"] {
        assert_eq!(status(&get(port, &page, &format!("Host: {host}\r\n"))), "200");
    }
    assert_eq!(status(&get(port, &page, "Host: evil.example\r\n")), "403");
    assert_eq!(
        status(&get(port, &page, "Host: localhost\r\nOrigin: http://evil.example\r\n")),
        "403"
    );
    assert_eq!(status(&get(port, &page, "Host: localhost\r\nOrigin: null\r\n")), "403");
    for token in ["", "?token=", "?token=0123456789abcdeX", "?token=0123456789abcdef0", "?oken=x"] {
        for path in ["/", "/page.js", "/events", "/nothing"] {
            let answer = get(port, &format!("{path}{token}"), "Host: localhost\r\n");
            assert_eq!(status(&answer), "403", "{path}{token}");
        }
    }
    for path in
        ["/../Cargo.toml", "/page/../../Cargo.toml", "/%2e%2e/x", "//etc/passwd", "/index.html"]
    {
        let answer = get(port, &format!("{path}?token={TOKEN}"), "Host: localhost\r\n");
        assert_eq!(status(&answer), "404", "{path}");
    }
}

#[test]
fn the_page_and_its_files_come_with_a_strict_policy() {
    let (_view, _commands, port) = start();
    for path in ["/", "/page.js", "/page.css", "/uplot.js", "/uplot.css", "/icon.svg"] {
        let answer = get(port, &format!("{path}?token={TOKEN}"), "Host: localhost\r\n");
        assert_eq!(status(&answer), "200", "{path}");
        for header in [
            "default-src 'none'",
            "frame-ancestors 'none'",
            "Cache-Control: no-store",
            "X-Content-Type-Options: nosniff",
            "Referrer-Policy: no-referrer",
        ] {
            assert!(answer.contains(header), "{path}: {header}");
        }
        assert!(!answer.contains("unsafe-inline"));
    }
}

#[test]
fn what_is_too_long_or_too_slow_is_let_go() {
    let (_view, _commands, port) = start();
    let long = format!("Host: localhost\r\nX: {}\r\n", "a".repeat(20_000));
    assert!(["431", ""].contains(&status(&get(port, "/", &long))));
    let body = format!("{{\"action\":\"zero\",\"x\":\"{}\"}}", "a".repeat(5_000));
    assert!(["413", ""].contains(&status(&post(port, "", &body))));
    let (mut slow, start) = (connect(port), Instant::now());
    slow.write_all(b"GET / HTTP/1.1\r\n").expect("written");
    let mut text = String::new();
    slow.read_to_string(&mut text).expect("an answer");
    assert_eq!(status(&text), "408");
    assert!(start.elapsed() < Duration::from_secs(10));
}

#[test]
fn many_idle_connections_do_not_keep_others_out() {
    let (_view, _commands, port) = start();
    let idle: Vec<_> = (0..200).map(|_| connect(port)).collect();
    let answer = get(port, &format!("/?token={TOKEN}"), "Host: localhost\r\n");
    assert_eq!(status(&answer), "200");
    drop(idle);
}

#[test]
fn a_sixth_viewer_is_refused_with_a_reason_and_may_come_later() {
    let (view, _commands, port) = start();
    view.set_status(Status::default());
    let request = format!("GET /events?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n\r\n");
    let mut viewers: Vec<_> = (0..5).map(|_| connect(port)).collect();
    for viewer in &mut viewers {
        viewer.write_all(request.as_bytes()).expect("written");
        assert!(viewer.read(&mut [0; 64]).expect("events") > 0);
    }
    let sixth = answer(port, &request);
    assert_eq!(status(&sixth), "503");
    assert!(sixth.contains("5 pages show this view already"));
    drop(viewers);
    let start = Instant::now();
    loop {
        let mut viewer = connect(port);
        viewer.write_all(request.as_bytes()).expect("written");
        let mut first = [0; 12];
        viewer.read_exact(&mut first).expect("an answer");
        if first.ends_with(b"200") {
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(10), "no place is free again");
        thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn commands_reach_the_source_and_its_answer_the_page() {
    let (_view, commands, port) = start();
    let source = thread::spawn(move || {
        for command in commands.iter().take(2) {
            match command.action {
                Action::Zero => command.answer(Err("the sensor is \"touched\"".into())),
                Action::Seek { to_s } => command.answer(Ok(format!("at {to_s} s"))),
                _ => {}
            }
        }
    });
    let refused = post(port, "", r#"{"action":"zero"}"#);
    assert_eq!(status(&refused), "409");
    assert!(refused.ends_with(r#"{"error":"the sensor is \"touched\""}"#), "{refused}");
    let done = post(port, "Origin: http://localhost:99\r\n", r#"{"action":"seek","to_s":1.5}"#);
    assert_eq!(status(&done), "200");
    assert!(done.ends_with(r#"{"message":"at 1.5 s"}"#), "{done}");
    source.join().expect("no panic");
    assert_eq!(status(&post(port, "", r#"{"action":"zero"}"#)), "409", "nobody takes commands now");
    for body in [
        r#"{"action":"erase"}"#,
        r#"{"action":"seek","to_s":-1}"#,
        r#"{"action":"seek"}"#,
        r#"{"action":"speed","factor":1e9}"#,
        r#"{"action":"step","frames":99999999}"#,
        "zero",
        "",
    ] {
        assert_eq!(status(&post(port, "", body)), "400", "{body}");
    }
    assert_eq!(
        status(&post(port, "Origin: http://evil.example\r\n", r#"{"action":"zero"}"#)),
        "403"
    );
}

#[test]
fn the_page_is_told_in_the_agreed_json() {
    let (view, _commands, port) = start();
    let channel = |name: &str, unit: &str| Channel { name: name.into(), unit: unit.into() };
    view.set_layout(Layout {
        title: "</script><script>alert(1)</script>\n".into(),
        readings: vec![channel("r1c1", "Ω")],
        outputs: vec![channel("r1e1_dz", "mm")],
        ..Layout::default()
    });
    view.set_baseline(vec![100.0, f32::NAN]);
    view.set_status(Status { message: "all is well".into(), ..Status::default() });
    view.show(Frame {
        number: 7,
        time_us: 9,
        readings: vec![1.5, f32::NAN],
        deviations: Some(vec![f32::INFINITY]),
        flags: vec![Flag::Novel],
        contact: Some(Contact::default()),
        force_n: Some(0.0),
        age_ms: 5.0,
        ..Frame::default()
    });
    let text = events(port, |text| text.matches("event:").count() >= 4);
    let data: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("data: ")).collect();
    let expected = [
        r#"{"title":"</script><script>alert(1)</script>\n","kind":"device","source":"","rows":0,"columns":0,"readings":[{"name":"r1c1","unit":"Ω"}],"outputs":[{"name":"r1e1_dz","unit":"mm"}],"electrodes":[],"scale_mm":0.0,"can":{"zero":false,"record":false,"seek":false},"duration_s":null}"#,
        "[100.0,null]",
        r#"{"state":"live","message":"all is well","scan_rate":null,"decode_rate":null,"rest":"","lost":0,"wires":[],"recording":null,"rmse_mm":null,"times_limit":null,"position_s":null,"speed":null,"event":null}"#,
    ];
    assert_eq!(data[..3], expected);
    let frame: serde_json::Value = serde_json::from_str(data[3]).expect("JSON");
    assert!(frame["age_ms"].as_f64() >= Some(5.0) && frame["sent_ms"].is_number());
    assert_eq!(frame["readings"], serde_json::json!([1.5, null]));
    assert_eq!(frame["deviations"], serde_json::json!([null]));
    assert_eq!(frame["flags"], serde_json::json!(["novel"]));
    assert!(frame["force_n"] == 0.0 && frame.get("truth").is_none());
}

#[test]
fn a_view_starts_again_on_its_port_with_its_token() {
    let (view, _commands, port) = start();
    let mut viewer = connect(port);
    write!(viewer, "GET /events?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n\r\n")
        .expect("written");
    view.set_status(Status::default());
    assert!(viewer.read(&mut [0; 16]).expect("events") > 0);
    drop(view);
    let mut rest = Vec::new();
    viewer.read_to_end(&mut rest).expect("events end with the view");
    let (view, _commands) = View::start(port, Some(TOKEN)).expect("the same port");
    assert_eq!(view.address(), format!("http://127.0.0.1:{port}/?token={TOKEN}"));
    assert!(View::start(0, Some("short")).is_err() && View::start(port, None).is_err());
}
