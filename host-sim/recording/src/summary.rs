//! Summary at the end of an MCAP file, from which readers know the file without passing over it.

use crate::record::{Fields, kind};

/// What the end of a file tells of it.
#[derive(Debug, Default)]
pub struct Summary {
    pub times: Times,
    /// Number of messages of each channel, from channel 1 on.
    pub messages: Vec<u64>,
    pub schemas: Group,
    pub channels: Group,
    pub chunks: Group,
    pub attachments: Group,
    pub metadata: Group,
}

/// Records of one kind.
#[derive(Debug, Default)]
pub struct Group {
    pub records: Fields,
    pub count: u32,
}

impl Group {
    /// Adds a record whose body consists of `parts`.
    pub fn add(&mut self, kind: u8, parts: &[&[u8]]) {
        self.records.record(kind, parts);
        self.count += 1;
    }
}

/// Earliest and latest time of messages, in ns, if there are any.
#[derive(Debug, Clone, Copy, Default)]
pub struct Times(pub Option<(u64, u64)>);

impl Times {
    pub fn add(&mut self, ns: u64) {
        self.0 = Some(self.0.map_or((ns, ns), |(first, last)| (first.min(ns), last.max(ns))));
    }

    /// Both; zeros if there are none.
    pub fn fields(self) -> Fields {
        let (first, last) = self.0.unwrap_or_default();
        Fields::new().u64(first).u64(last)
    }
}

impl Summary {
    /// All records, in groups of a kind.
    pub fn groups(self) -> [Fields; 6] {
        let Self { times, messages, schemas, channels, chunks, attachments, metadata } = self;
        let counts = Fields::new().u64(messages.iter().sum()).u16(schemas.count as u16);
        let counts = counts.u32(channels.count).u32(attachments.count).u32(metadata.count);
        let counts = counts.u32(chunks.count);
        let by_channel = (1..).zip(messages);
        let by_channel =
            by_channel.fold(Fields::new(), |all, (number, it)| all.u16(number).u64(it));
        let by_channel = Fields::new().sequence(by_channel.bytes());
        let times = times.fields();
        let mut statistics = Fields::new();
        let parts = [counts.bytes(), times.bytes(), by_channel.bytes()];
        statistics.record(kind::STATISTICS, &parts);
        let [schemas, channels] = [schemas, channels].map(|group| group.records);
        let [chunks, attachments, metadata] = [chunks, attachments, metadata].map(|it| it.records);
        [schemas, channels, statistics, chunks, attachments, metadata]
    }
}
