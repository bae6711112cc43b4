//! Tables in every dialect hold the same numbers, and damaged ones are read or refused.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::{Duration, Instant};
use stereology_shape::{Table, TableError, TableSource, parse_points};

/// How a table is written.
#[derive(Clone, Debug)]
struct Dialect {
    separator: &'static str,
    decimal_comma: bool,
    grouped: bool,
    quoted: bool,
    trailing: bool,
    empty_rows: bool,
    sep_line: bool,
    index: bool,
    head: &'static str,
    units_row: bool,
    line_end: &'static str,
    encoding: usize,
}

fn dialects() -> impl Strategy<Value = Dialect> {
    let separator = prop_oneof![Just(","), Just(";"), Just("\t"), Just("  "), Just("|")];
    let line_end = prop_oneof![Just("\n"), Just("\r\n"), Just("\r")];
    let head = prop_oneof![
        Just(""),
        Just("# unit=mm\n"),
        Just("Section one\n"),
        Just("\n\n# by hand\n")
    ];
    (
        (separator, line_end, head, 0_usize..7),
        prop::array::uniform8(any::<bool>()),
    )
        .prop_map(|((separator, line_end, head, encoding), flags)| {
            let [
                decimal_comma,
                grouped,
                quoted,
                trailing,
                empty_rows,
                sep_line,
                index,
                units_row,
            ] = flags;
            let blanks = separator == "  ";
            Dialect {
                separator,
                decimal_comma,
                grouped,
                quoted,
                trailing: trailing && !blanks,
                empty_rows,
                // It must be the first line.
                sep_line: sep_line && !blanks && head.is_empty(),
                // Blanks cannot hold an empty name.
                index: index && !blanks,
                head,
                units_row: units_row && !blanks,
                line_end,
                encoding,
            }
        })
}

impl Dialect {
    fn number(&self, value: f64) -> String {
        let text = value.to_string();
        let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
        let (mark, group) = if self.decimal_comma { (",", ".") } else { (".", ",") };
        let mut whole = whole.to_owned();
        if self.grouped {
            let digits = whole.trim_start_matches('-').len();
            let first = whole.len() - digits;
            for at in (1..digits).rev().filter(|at| (digits - at) % 3 == 0) {
                whole.insert_str(first + at, group);
            }
        }
        if fraction.is_empty() {
            whole
        } else {
            format!("{whole}{mark}{fraction}")
        }
    }

    fn row(&self, fields: &[String]) -> String {
        let quote = |field: &String| {
            let needed = field.contains(self.separator.trim()) && !self.separator.trim().is_empty()
                || field.contains([' ', '"', '\n']);
            if self.quoted || needed {
                format!("\"{}\"", field.replace('"', "\"\""))
            } else {
                field.clone()
            }
        };
        let mut row = fields.iter().map(quote).collect::<Vec<_>>().join(self.separator);
        if self.trailing {
            row += self.separator;
        }
        row + "\n"
    }

    /// A table of labels and two columns of numbers.
    fn write(&self, rows: &[(String, f64, f64)]) -> Vec<u8> {
        let mut text = String::new();
        if self.sep_line {
            text += &format!("sep={}\n", self.separator);
        }
        text += self.head;
        let mut names = vec!["Label".to_owned(), "area".to_owned(), "y".to_owned()];
        let mut units = vec![String::new(), "µm^2".to_owned(), String::new()];
        if self.index {
            names.insert(0, String::new());
            units.insert(0, String::new());
        } else if !self.units_row && self.separator != "  " {
            names[1] = "area [µm²]".to_owned();
        }
        text += &self.row(&names);
        if self.units_row {
            text += &self.row(&units);
        }
        for (at, (label, a, b)) in rows.iter().enumerate() {
            let mut fields = vec![label.clone(), self.number(*a), self.number(*b)];
            if self.index {
                fields.insert(0, at.to_string());
            }
            text += &self.row(&fields);
            if self.empty_rows {
                text += if at % 2 == 0 { "\n" } else { "   \n" };
            }
        }
        let text = text.replace('\n', self.line_end);
        let le = text.encode_utf16().flat_map(u16::to_le_bytes);
        let be = text.encode_utf16().flat_map(u16::to_be_bytes);
        match self.encoding {
            0 => text.into_bytes(),
            1 => [b"\xEF\xBB\xBF", text.as_bytes()].concat(),
            2 => b"\xFF\xFE".iter().copied().chain(le).collect(),
            3 => b"\xFE\xFF".iter().copied().chain(be).collect(),
            4 => le.collect(),
            5 => be.collect(),
            _ => text.chars().map(|c| u8::try_from(c).unwrap()).collect(),
        }
    }
}

fn read(bytes: &[u8]) -> Result<Table, TableError> {
    TableSource {
        columns: &["area"],
        slashes: false,
    }
    .parse(bytes)
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -1e7..1e7_f64,
        1e-9..1e3_f64,
        (0_u32..2000).prop_map(f64::from),
        (0_u32..100_000).prop_map(|k| f64::from(k) / 100.0)
    ]
}

fn labels() -> impl Strategy<Value = String> {
    prop_oneof![
        Just("quartz".to_owned()),
        Just("thin section, 1.tif".to_owned()),
        Just("D\u{fc}nnschliff; 2|b".to_owned()),
        Just("a \"good\" one\nof two lines".to_owned()),
    ]
}

proptest! {
    /// The numbers of a table do not depend on how it is written: separator, decimal mark, marks between thousands,
    /// encoding, line ends, quotes, empty rows, units, titles.
    #[test]
    fn numbers_do_not_depend_on_the_dialect(
        dialect in dialects(), rows in prop::collection::vec((labels(), number(), number()), 1..20),
    ) {
        // One number that decides the decimal mark, as almost all tables have.
        let mut rows = rows;
        rows.push(("last".to_owned(), 0.25, 1234.5));
        let bytes = dialect.write(&rows);
        let table = read(&bytes).unwrap();
        let area = table.column(&["area"]).unwrap();
        let y = table.column(&["y"]).unwrap();
        let (Some(area), Some(y)) = (area, y) else {
            return Err(TestCaseError::fail(format!("{:?}", table.columns())));
        };
        let found: Result<Vec<[u64; 2]>, TableError> = table
            .rows()
            .map(|row| {
                row.check_width()?;
                Ok([row.number(area)?.to_bits(), row.number(y)?.to_bits()])
            })
            .collect();
        let expected: Vec<[u64; 2]> = rows.iter().map(|(_, a, b)| [a.to_bits(), b.to_bits()]).collect();
        prop_assert_eq!(found.unwrap(), expected);
        let unit = table.columns()[area].unit.as_ref().map(|unit| (unit.length, unit.power));
        let has_unit = dialect.units_row || (!dialect.index && dialect.separator != "  ");
        prop_assert_eq!(unit, has_unit.then_some(("um", 2)));
        let plain = dialect.separator == "," && !dialect.decimal_comma;
        // Latin-1 without accents is UTF-8.
        let plain = plain && (dialect.encoding < 2 || (dialect.encoding == 6 && bytes.is_ascii()));
        prop_assert_eq!(table.format().is_none(), plain, "{:?}", table.format());
    }
}

#[test]
fn what_does_not_decide_is_reported() {
    for (text, value, undecided) in [
        ("id;area\n1;403,727\n2;482,629\n", 403.727, true),
        ("id\tarea\n1\t403,727\n2\t482,629\n", 403.727, true),
        ("id,area\n1,\"4,037\"\n2,\"4,826\"\n", 4037.0, true),
        ("id;area;y\n1;4.037;1,5\n2;4.826;2\n", 4037.0, false),
        ("id;area;y\n1;4,037;1.5\n2;4,826;2\n", 4037.0, false),
        ("id;area\n1;4.037\n2;4.826\n", 4.037, false),
        // A comma that separates places of a column of text decides nothing about other columns.
        ("at,area\n\"12,25\",4.5\n\"13,25\",4.75\n", 4.5, false),
    ] {
        let table = read(text.as_bytes()).unwrap();
        let area = table.column(&["area"]).unwrap().unwrap();
        let first = table.rows().next().unwrap().number(area).unwrap();
        assert_eq!(first.to_bits(), f64::to_bits(value), "{text}");
        let format = table.format().unwrap_or_default();
        assert_eq!(format.contains("no field decides"), undecided, "{text}: {format}");
    }
}

/// Blanks inside fields separate nothing where commas do.
#[test]
fn words_with_blanks_are_single_fields() {
    for text in [
        "area,slice\n2.5,section 1\n",
        "place,area\n1 2,2.5\n",
        "id a,area\n2,2.5\n",
        "a b c,area\nd e f,2.5\n",
    ] {
        let table = read(text.as_bytes()).unwrap();
        let area = table.column(&["area"]).unwrap().unwrap();
        assert_eq!(table.rows().next().unwrap().number(area), Ok(2.5), "{text}");
    }
}

#[test]
fn rows_of_statistics_are_left_out_and_reported() {
    let text = "Label,Area\na,1\nMin,2\nb,3\nMean,2\nSD,1\nMin,1\nMax,3\n";
    let table = read(text.as_bytes()).unwrap();
    // A label that is such a word leaves the rows in the table.
    assert_eq!(table.rows().count(), 7);
    let table = read(text.replace("Min,2\n", "").as_bytes()).unwrap();
    assert_eq!(table.rows().count(), 2);
    assert!(
        table.remarks()[0].starts_with("the last 4 rows, from line 4 on"),
        "{:?}",
        table.remarks()
    );
}

#[test]
fn rows_that_look_like_comments_are_reported() {
    let text = "id,area\n1,2\n# by hand\n#2,3\n3,4\n";
    let table = read(text.as_bytes()).unwrap();
    assert_eq!(
        table.remarks(),
        ["1 rows that begin with # were left out as comments, the first in line 4"]
    );
}

/// Any bytes are read or refused, quickly: tables of all dialects with bytes changed, removed, inserted and repeated.
#[test]
fn damaged_tables_are_read_or_refused() {
    let seeds: [&[u8]; 9] = [
        b" ,Label,Area,Mean\n1,\"a, b\",403.727,1\n2,\"c \"\"d\"\"\",482.6,2\n,,,\nMean,x,1,2\nSD,x,1,2\n",
        b"sep=;\r\nid;Area [\xb5m\xb2];y\r\n1;1.403,727;5,5\r\n2;12,5;NaN\r\n",
        b"60\nFeature_ID,EquivalentDiameters\n1,22.67\n2,24.79\nFeature_ID,Neighbours\n1,2\n",
        b"# unit=mm\n# area=3\nx y z\n1 2 3\n4 5 6\n",
        b"//X Y Z R G B\n1 2 3 255 0 0\n4 5 6 0 0 0\n",
        b"\xFF\xFEa\0r\0e\0a\0\n\x001\0,\x005\0\n\x002\0\n\0",
        b"area\r403,727\r482,629\r1.234.567\r",
        b"\"area\" \"y\"\n\"1\" 403.7 2\n\"2\" 1e5 -3\n",
        b"Label,Area,Mean\n#,[um^2],[-]\na,1,2\nb,-3,1e400\n",
    ];
    const WORDS: [&[u8]; 12] = [
        b"\"", b"\"\"", b"\n", b"\r", b",", b";", b"\t", b"nan", b"1e400", b"1,234", b"\0", b"#",
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    for case in 0..10_000 {
        let mut bytes = seeds[case % seeds.len()].to_vec();
        for _ in 0..rng.random_range(1..5) {
            let at = rng.random_range(0..=bytes.len().max(1) - 1).min(bytes.len());
            let to = (at + rng.random_range(0..12)).min(bytes.len());
            match rng.random_range(0..5) {
                0 if at < bytes.len() => bytes[at] = rng.random(),
                1 => bytes.truncate(at),
                2 => drop(bytes.drain(at..to)),
                3 => {
                    let piece = bytes[at..to].to_vec();
                    bytes.splice(at..at, piece);
                }
                _ => drop(bytes.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
            }
        }
        let start = Instant::now();
        visit(&bytes);
        assert!(start.elapsed() < Duration::from_secs(5), "case {case}");
    }
    // Long tables of one row, of quotes, of separators and of words take time in proportion to their length.
    for piece in [
        "\"",
        ",",
        "a,",
        "a,\n",
        "1 ",
        "Mean\n",
        "1,",
        "\"a\nb\",",
        "#\n",
        "area\n",
        "1;2,5\t",
    ] {
        let start = Instant::now();
        visit(piece.repeat(100_000).as_bytes());
        assert!(start.elapsed() < Duration::from_secs(20), "{piece:?}");
    }
}

/// Reads everything that a table offers.
fn visit(bytes: &[u8]) {
    let _ = parse_points(bytes, "bytes".as_ref());
    let Ok(table) = read(bytes) else { return };
    let _ = (table.format(), table.remarks(), table.column(&["area", "x"]));
    let columns = table.columns().len().max(1);
    for row in table.rows() {
        let _ = row.check_width();
        for column in 0..=columns.min(8) {
            assert!(row.number(column).is_ok_and(f64::is_finite) || row.number(column).is_err());
        }
    }
}
