//! Damage: nothing panics, every byte is accounted for, and what is whole is found.

use dataflash::{Log, LogWriter, MessageDef, ScanStats, Select, Table, Value, catalog};

/// splitmix64: a few reproducible bytes without a generator's set-up.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next() as u8).collect()
    }
}

const MESSAGES: [&MessageDef; 4] = [&catalog::ATT, &catalog::RCOU, &catalog::PSCD, &catalog::MSG];

/// The definitions and then each message by itself.
fn parts() -> (Vec<u8>, Vec<Vec<u8>>) {
    let header = LogWriter::new(Vec::new(), &MESSAGES).unwrap().finish().unwrap();
    let mut rows = Vec::new();
    for step in 0..60 {
        let time = Value::Int(5_000_000 + step * 100_000);
        let mut attitude = vec![Value::Float(step as f64 * 0.37); 10];
        let mut outputs = vec![Value::Int(1500 + step); 15];
        let mut position = vec![Value::Float(step as f64 * 0.125); 9];
        for row in [&mut attitude, &mut outputs, &mut position] {
            row[0] = time;
        }
        let text = format!("text {step}");
        let all: [(&'static MessageDef, &[Value<'_>]); 4] = [
            (&catalog::ATT, &attitude),
            (&catalog::RCOU, &outputs),
            (&catalog::PSCD, &position),
            (&catalog::MSG, &[time, Value::Text(&text)]),
        ];
        for (message, values) in all {
            let mut writer = LogWriter::new(Vec::new(), &MESSAGES).unwrap();
            writer.row(message, values).unwrap();
            rows.push(writer.finish().unwrap().split_off(header.len()));
        }
    }
    (header, rows)
}

fn whole() -> Vec<u8> {
    let (mut bytes, rows) = parts();
    bytes.extend(rows.concat());
    bytes
}

const WANTED: [Select<'static>; 5] = [
    Select { message: "ATT", fields: &["TimeUS", "Roll", "Yaw", "AEKF"] },
    Select { message: "RCOU", fields: &["TimeUS", "C1", "C14"] },
    Select { message: "PSCD", fields: &["TimeUS", "VD"] },
    Select { message: "MSG", fields: &["Message"] },
    Select { message: "FMT", fields: &["Name"] },
];

fn tables(bytes: &[u8]) -> (Vec<Table>, ScanStats) {
    Log::from_bytes(bytes.to_vec()).select(&WANTED)
}

/// Reads anything and checks what holds for any bytes; gives the rows of the four messages.
fn survives(bytes: &[u8]) -> usize {
    let (tables, stats) = tables(bytes);
    for table in &tables {
        assert!(table.numbers.iter().all(|(_, column)| column.len() == table.rows));
        assert!(table.texts.iter().all(|(_, column)| column.len() == table.rows));
    }
    let inventory = Log::from_bytes(bytes.to_vec()).inventory();
    assert_eq!(inventory.stats, stats);
    let read: u64 = inventory.messages.iter().map(|message| message.bytes).sum();
    assert_eq!(read + stats.bad_bytes + stats.truncated_bytes, bytes.len() as u64, "{stats:?}");
    tables[..4].iter().map(|table| table.rows).sum()
}

#[test]
fn a_file_reads_as_its_bytes_do() {
    let (header, rows) = parts();
    let mut noise = Noise(5);
    let folder = tempfile::tempdir().unwrap();
    for round in 0..40 {
        // Several times as long as the pieces in which a file is read.
        let mut bytes = header.clone();
        while bytes.len() < 400_000 {
            bytes.extend(&rows[noise.below(rows.len())]);
        }
        for _ in 0..round {
            let at = header.len() + noise.below(bytes.len() - header.len() - 300);
            bytes.splice(at..at + noise.below(300), noise.bytes(noise.0 as usize % 9));
        }
        bytes.truncate(bytes.len() - noise.below(60));
        let path = folder.path().join("log.BIN");
        std::fs::write(&path, &bytes).unwrap();
        let file = Log::open(&path).unwrap();
        let memory = Log::from_bytes(bytes);
        assert_eq!(file.inventory(), memory.inventory(), "round {round}");
        // NaN is not itself; its text is.
        let [file, memory] = [file, memory].map(|log| format!("{:?}", log.select(&WANTED)));
        assert_eq!(file, memory, "round {round}");
    }
}

#[test]
fn every_prefix_reads_up_to_its_end() {
    let bytes = whole();
    let mut last = 0;
    for end in (0..bytes.len()).filter(|end| *end < 300 || end % 7 == 0) {
        let rows = survives(&bytes[..end]);
        assert!(rows >= last, "at {end}");
        last = rows;
    }
    assert_eq!(survives(&bytes), 240);
    let (_, stats) = tables(&bytes[..bytes.len() - 1]);
    assert_eq!(stats.truncated_bytes, 74);
}

#[test]
fn flipped_bytes_cost_no_more_than_their_neighbourhood() {
    let bytes = whole();
    let header = parts().0.len();
    let mut noise = Noise(1);
    for round in 0..3000 {
        let mut damaged = bytes.clone();
        for _ in 0..=round % 8 {
            let at = noise.below(damaged.len());
            damaged[at] ^= 1 << noise.below(8);
        }
        survives(&damaged);
        let mut one = bytes.clone();
        one[header + noise.below(bytes.len() - header)] = noise.next() as u8;
        assert!(survives(&one) >= 239);
    }
}

#[test]
fn random_bytes_survive() {
    let mut noise = Noise(2);
    let header = parts().0;
    for _ in 0..200 {
        let length = noise.below(4000);
        let junk = noise.bytes(length);
        survives(&junk);
        survives(&[header.clone(), junk].concat());
    }
}

#[test]
fn all_messages_between_garbage_are_found() {
    let (header, rows) = parts();
    let clean = tables(&whole()).0;
    for seed in 0..20 {
        let mut noise = Noise(seed);
        let mut bytes = header.clone();
        let mut added = 0;
        for row in &rows {
            // The start of a header among it, to lead the search astray.
            let length = noise.below(40);
            let mut junk = noise.bytes(length);
            junk.extend_from_slice(&[0xA3, 0x95][..noise.below(3)]);
            added += junk.len() as u64;
            bytes.extend_from_slice(&junk);
            bytes.extend_from_slice(row);
        }
        let (tables, stats) = tables(&bytes);
        assert_eq!(tables, clean, "seed {seed}");
        assert_eq!((stats.bad_bytes, stats.time_jumps), (added, 0));
    }
}

#[test]
fn a_lost_piece_takes_only_what_it_touches() {
    let (header, rows) = parts();
    let bytes = whole();
    let mut ends = vec![header.len()];
    for row in &rows {
        ends.push(ends[ends.len() - 1] + row.len());
    }
    let mut noise = Noise(3);
    let mut exact = 0;
    for _ in 0..500 {
        let from = header.len() + noise.below(bytes.len() - header.len() - 1);
        let to = (from + 1 + noise.below(600)).min(bytes.len());
        let left = ends.windows(2).filter(|row| row[1] <= from || row[0] >= to).count();
        let damaged = [&bytes[..from], &bytes[to..]].concat();
        // A message that got another tail cannot be told from a whole one before garbage. If by
        // chance a message starts where it should have ended, up to two are hidden in it.
        let found = survives(&damaged);
        assert!((left - 2..=left + 1).contains(&found), "{found} of {left} without {from}..{to}");
        exact += usize::from(found >= left);
    }
    assert!(exact > 450, "{exact}");
}

fn fmt(id: u8, length: u8, name: &[u8], letters: &[u8], labels: &[u8]) -> Vec<u8> {
    let mut row = vec![0xA3, 0x95, 128, id, length];
    for (text, size) in [(name, 4), (letters, 16), (labels, 64)] {
        let end = row.len() + size;
        row.extend_from_slice(text);
        row.resize(end, 0);
    }
    row
}

#[test]
fn hostile_formats_are_refused_and_the_rest_is_read() {
    let (header, rows) = parts();
    let lies = [
        fmt(70, 255, b"ATT", b"QccccCCCCB", b"TimeUS,DesRoll"),
        fmt(70, 3, b"ATT", b"QccccCCCCB", b"TimeUS,DesRoll"),
        fmt(70, 0, b"ATT", b"", b""),
        fmt(9, 17, b"ODD", b"Q!y", b"A,B,C"),
        fmt(128, 28, b"FMT", b"QccccCCCCB", b"TimeUS"),
        fmt(9, 255, b"BIG", b"ZZZZZZZZZZZZZZZZ", b"A"),
    ];
    let bytes = [header.clone(), lies.concat(), rows.concat()].concat();
    assert_eq!(survives(&bytes), 240);
    assert_eq!(tables(&bytes).1.rejected_formats, lies.len() as u64);
    let odd = [
        fmt(9, 3, b"\0\0\0\0", b"", b""),
        fmt(10, 255, b"MAX", b"ZZZNNNBBBBBBBBHH", b"\xff\xfe,,,"),
        fmt(11, 4, b"\xc3\x28ab", b"B", b""),
    ];
    let odd_rows = [vec![0xA3, 0x95, 9], vec![0xA3, 0x95, 11, 7]];
    let bytes = [header, odd.concat(), odd_rows.concat(), rows.concat()].concat();
    assert_eq!(survives(&bytes), 240);
    assert_eq!(tables(&bytes).1, ScanStats::default());
}

#[test]
fn unknown_types_are_counted_and_passed() {
    let (header, rows) = parts();
    let unknown = [vec![0xA3, 0x95, 9], vec![1; 20]].concat();
    let bytes = [header, rows[0].clone(), unknown, rows[1..].concat()].concat();
    assert_eq!(survives(&bytes), 240);
    let stats = tables(&bytes).1;
    assert_eq!((stats.unknown, stats.bad_bytes), (1, 23));
}

#[test]
fn a_type_may_be_defined_anew() {
    let (header, rows) = parts();
    let other = fmt(70, 15, b"ATT", b"Qf", b"TimeUS,Roll");
    let row = [&[0xA3, 0x95, 70][..], &9_000_000u64.to_le_bytes(), &2.5f32.to_le_bytes()].concat();
    let bytes = [header, rows[0].clone(), other, row].concat();
    let (tables, stats) = tables(&bytes);
    assert_eq!(stats, ScanStats::default());
    assert_eq!(tables[0].rows, 2);
    assert_eq!(tables[0].number("TimeUS"), Some(&[5e6, 9e6][..]));
    assert_eq!(tables[0].number("Roll"), Some(&[0.0, 2.5][..]));
    let yaw = tables[0].number("Yaw").unwrap();
    assert!(yaw[0] == 0.0 && yaw[1].is_nan());
    let inventory = Log::from_bytes(bytes).inventory();
    assert_eq!(inventory.messages.iter().filter(|message| message.name == "ATT").count(), 2);
}

#[test]
fn two_boots_in_one_file_are_both_read() {
    let bytes = whole();
    let twice = [bytes.clone(), bytes].concat();
    assert_eq!(survives(&twice), 480);
    let inventory = Log::from_bytes(twice).inventory();
    assert_eq!((inventory.boots, inventory.stats.time_jumps), (2, 1));
    let jump = inventory.time_jumps[0];
    assert_eq!((jump.from_us, jump.to_us), (10_900_000, 5_000_000));
}

#[test]
fn time_may_jump_and_waver() {
    let log = |times: &[i64]| {
        let mut writer = LogWriter::new(Vec::new(), &[&catalog::EV]).unwrap();
        for &time in times {
            writer.row(&catalog::EV, &[Value::Int(time), Value::Int(1)]).unwrap();
        }
        Log::from_bytes(writer.finish().unwrap()).inventory().stats.time_jumps
    };
    assert_eq!(log(&[500_000_000, 560_000_000, 559_000_000, 560_500_000]), 0);
    assert_eq!(log(&[500_000_000, 560_000_001]), 1);
    assert_eq!(log(&[500_000_000, 498_999_999, 499_000_000]), 1);
    // A corrupt time is left again.
    assert_eq!(log(&[1_000_000, i64::MAX, 1_100_000, 1_200_000]), 2);
}

#[test]
fn a_log_without_units_is_read() {
    let (_, rows) = parts();
    let format = fmt(70, 28, b"ATT", b"QccccCCCCB", catalog::ATT.fields.as_bytes());
    let (tables, stats) = tables(&[format, rows[4].clone()].concat());
    assert_eq!(stats, ScanStats::default());
    assert_eq!(tables[0].number("Roll"), Some(&[0.37][..]));
    assert_eq!((tables[0].unit("Roll"), tables[0].multiplier("Roll")), (None, None));
}

#[test]
fn a_message_cut_short_does_not_swallow_the_next() {
    let (header, rows) = parts();
    let cut = &rows[1][..20];
    let bytes = [header, rows[0].clone(), cut.to_vec(), rows[2..].concat()].concat();
    let (found, stats) = tables(&bytes);
    let (clean, _) = tables(&whole());
    assert_eq!(found[1].rows, 59);
    assert_eq!(found[1].number("C1"), clean[1].number("C1").map(|column| &column[1..]));
    assert_eq!((&found[0], &found[2], &found[3]), (&clean[0], &clean[2], &clean[3]));
    assert_eq!(stats.bad_bytes, 20);
}

#[test]
fn a_header_by_chance_makes_no_message() {
    let (header, rows) = parts();
    let junk = [vec![0xA3, 0x95, catalog::ATT.id], Noise(4).bytes(60)].concat();
    let bytes = [header.clone(), rows[0].clone(), junk, rows[1..].concat()].concat();
    let (found, stats) = tables(&bytes);
    assert_eq!(found, tables(&whole()).0);
    assert_eq!((stats.bad_bytes, stats.time_jumps), (63, 0));
    // One that would reach beyond the end of the file.
    let chance = [0xA3, 0x95, catalog::MSG.id].to_vec();
    let (found, stats) = tables(&[header, chance, rows[0].clone()].concat());
    assert_eq!((found[0].rows, found[3].rows), (1, 0));
    assert_eq!((stats.bad_bytes, stats.truncated_bytes), (3, 0));
}

#[test]
fn a_format_said_again_keeps_its_units() {
    let (header, rows) = parts();
    let again = fmt(70, 28, b"ATT", b"QccccCCCCB", catalog::ATT.fields.as_bytes());
    let (found, _) = tables(&[header.clone(), again, rows[0].clone()].concat());
    assert_eq!(found[0].unit("Roll"), Some("deg"));
    // Another format has other units, which the log does not give.
    let other = fmt(70, 15, b"ATT", b"Qf", b"TimeUS,Roll");
    assert_eq!(tables(&[header, other].concat()).0[0].unit("Roll"), None);
}

#[test]
fn what_is_cut_off_or_replaced_meanwhile_is_missing_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.BIN");
    let bytes = [whole(), whole(), whole()].concat();
    std::fs::write(&path, &bytes).unwrap();
    let log = Log::open(&path).unwrap();
    let before = log.inventory();
    // A map of the file would end the program here (SIGBUS).
    let cut = whole().len() + 10;
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(cut as u64).unwrap();
    let after = log.inventory();
    assert_eq!(after.size_bytes, bytes.len() as u64);
    assert_eq!(after.stats.truncated_bytes, (bytes.len() - whole().len()) as u64);
    assert!(after.messages.iter().map(|one| one.count).sum::<u64>() > 0);
    assert!(after.messages.iter().zip(&before.messages).all(|(now, then)| now.count <= then.count));
    // Somebody puts another log in its place: that is not taken for it.
    std::fs::write(folder.path().join("other"), whole()).unwrap();
    std::fs::rename(folder.path().join("other"), &path).unwrap();
    let gone = log.inventory();
    assert_eq!(gone.stats.truncated_bytes, bytes.len() as u64);
    assert!(gone.messages.iter().all(|one| one.count == 0));
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("00000001.BIN");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    for path in [pipe.as_path(), "/dev/zero".as_ref(), folder.path()] {
        let error = Log::open(path).unwrap_err();
        assert!(matches!(error, dataflash::LogError::Open { .. }), "{error}");
    }
}
