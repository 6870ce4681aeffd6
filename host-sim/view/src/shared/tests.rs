use super::*;

/// What a viewer that has seen nothing gets first.
fn first_news(shared: &Shared) -> String {
    shared.news(&mut Seen::nothing(Duration::ZERO)).expect("open").concat()
}

/// Ends the printer even if a test fails.
struct Closes<'shared>(&'shared Shared);

impl Drop for Closes<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Prints during `work`.
fn while_printing(shared: &Shared, work: impl FnOnce()) {
    thread::scope(|scope| {
        let _closes = Closes(shared);
        scope.spawn(|| shared.print());
        work();
    });
}

fn numbered(number: u64) -> Frame {
    Frame { number, ..Frame::default() }
}

#[test]
fn the_newest_frame_wins() {
    let shared = Shared::new();
    (0..1000).for_each(|number| shared.show(numbered(number)));
    while_printing(&shared, || {
        let _place = shared.place(1);
        let news = first_news(&shared);
        assert!(news.contains("event: frame\ndata: {\"number\":999,"), "{news}");
    });
}

#[test]
fn a_viewer_that_does_not_read_does_not_hold_up_the_feeder() {
    let shared = Shared::new();
    while_printing(&shared, || {
        let _place = shared.place(1);
        let start = Instant::now();
        (0..100_000).for_each(|number| shared.show(numbered(number)));
        assert!(start.elapsed() < Duration::from_secs(5));
    });
}

#[test]
fn nothing_is_printed_while_nobody_views() {
    let shared = Shared::new();
    while_printing(&shared, || {
        shared.show(numbered(1));
        thread::sleep(Duration::from_millis(50));
        assert!(shared.lock().given.frame.is_some());
    });
}

#[test]
fn a_new_layout_clears_the_previous_frame_and_baseline() {
    let shared = Shared::new();
    while_printing(&shared, || {
        let _place = shared.place(1);
        shared.set_layout(Layout::default());
        shared.set_baseline(vec![1.0]);
        shared.show(numbered(1));
        while shared.lock().events[FRAME].text.is_none() {
            thread::yield_now();
        }
        shared.set_layout(Layout { title: "new".into(), ..Layout::default() });
        let (mut seen, mut news) = (Seen::nothing(Duration::ZERO), String::new());
        while !news.contains("event: layout") {
            news = shared.news(&mut seen).expect("open").concat();
            assert!(!news.contains("event: frame") && !news.contains("event: baseline"), "{news}");
        }
        assert!(news.contains("new"));
    });
}

#[test]
fn the_status_comes_once_a_second() {
    let shared = Shared::new();
    while_printing(&shared, || {
        let _place = shared.place(1);
        let mut seen = Seen::nothing(Duration::ZERO);
        let start = Instant::now();
        for _ in 0..2 {
            let news = shared.news(&mut seen).expect("open").concat();
            assert!(news.starts_with("event: status\ndata: {\"state\":\"live\""), "{news}");
        }
        let waited = start.elapsed();
        assert!((900..3000).contains(&waited.as_millis()), "{waited:?}");
    });
}

#[test]
fn places_are_few_and_free_again() {
    let shared = Shared::new();
    let one = shared.place(2);
    let two = shared.place(2);
    assert!(one.is_some() && two.is_some() && shared.place(2).is_none());
    drop(one);
    assert!(shared.place(2).is_some());
}

#[test]
fn frames_come_no_faster_than_a_viewer_asks() {
    let shared = Shared::new();
    while_printing(&shared, || {
        let _place = shared.place(1);
        let mut seen = Seen::nothing(Duration::from_millis(200));
        let mut times = Vec::new();
        thread::scope(|scope| {
            scope.spawn(|| {
                for number in 0..500 {
                    shared.show(numbered(number));
                    thread::sleep(Duration::from_millis(1));
                }
            });
            while times.len() < 3 {
                if shared.news(&mut seen).expect("open").concat().contains("frame") {
                    times.push(Instant::now());
                }
            }
        });
        assert!(times[2] - times[0] >= Duration::from_millis(380));
    });
}
