//! A folder written by rosbag2: `metadata.yaml` and one or more MCAP or SQLite files.

use std::{
    cmp::Ordering,
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use tipwatch_language::{say, word};

use super::{log_files::LogFiles, rosbag2_metadata::Metadata};
use crate::{
    file::{Format, Source},
    message::{Error, Losses, LostPart, LostRange},
};

const METADATA_NAME: &str = "metadata.yaml";
/// Endings of files that were compressed after the recording.
const PACKED: [&str; 5] = [".zstd", ".zst", ".gz", ".bz2", ".lz4"];
/// Levels of subfolders in which split files are looked for.
const MOST_NESTED_FOLDERS: usize = 3;
/// Far above any real file, which takes a few hundred bytes per topic.
const METADATA_LIMIT_BYTES: u64 = 64 << 20;

/// The files of a folder that form one log, in order.
pub(crate) fn recognise(folder: &Path, source: &Source) -> Result<LogFiles, Error> {
    let mut losses = Losses::default();
    let found = log_files_below(folder, source, MOST_NESTED_FOLDERS)?;
    let metadata = read_metadata(folder, source, &mut losses)?;
    let listed = listed_files(folder, source, &metadata, &mut losses)?;
    let is_listed = !listed.is_empty();
    let found = without_copies(found, &listed, &mut losses);
    let mut files = if is_listed {
        with_parts_behind(listed, &found, &mut losses)
    } else {
        refuse_several_logs(folder, &found)?;
        found
    };
    let format = common_format(folder, source, &mut files, &mut losses)?;
    let left_out = match is_listed {
        true => Vec::new(),
        false => left_out(&files, source, &losses)?,
    };
    Ok(LogFiles {
        format,
        files,
        left_out,
        losses,
        has_packed_messages: metadata.packs_messages(),
        declared_counts: metadata.message_counts,
    })
}

/// The metadata; empty if the file is missing or damaged.
fn read_metadata(folder: &Path, source: &Source, losses: &mut Losses) -> Result<Metadata, Error> {
    let path = folder.join(METADATA_NAME);
    if !source.is_file(&path) {
        losses.note(say!(
            "{METADATA_NAME} is missing: the files are read in order of name"
        ));
        return Ok(Metadata::default());
    }
    let size = source.bytes(&path);
    if size > METADATA_LIMIT_BYTES {
        losses.note(say!(
            "{METADATA_NAME} has {size} bytes and is ignored: at most {METADATA_LIMIT_BYTES} are read"
        ));
        return Ok(Metadata::default());
    }
    let bytes = source.read(&path)?;
    let metadata = Metadata::parse(&String::from_utf8_lossy(&bytes)).unwrap_or_else(|problem| {
        let reason = say!("not valid metadata: {problem}; the files are read in order of name");
        losses.push(LostRange {
            message_count: Some(0),
            ..LostRange::of(LostPart::Records, &path, 0..size, reason)
        });
        Metadata::default()
    });
    refuse_compression(folder, &metadata)?;
    Ok(metadata)
}

/// The existing files that the metadata lists, in its order; empty without metadata.
fn listed_files(
    folder: &Path,
    source: &Source,
    metadata: &Metadata,
    losses: &mut Losses,
) -> Result<Vec<PathBuf>, Error> {
    let (mut present, mut missing) = (Vec::new(), Vec::new());
    for name in &metadata.files {
        let file = present_file(folder, source, name);
        // a file that stands in for two names is read once
        match source.is_file(&file) && !present.contains(&file) {
            true => present.push(file),
            false => missing.push((name, present.len())),
        }
    }
    for (name, before) in missing {
        let contents = metadata.contents.get(name);
        let is_at_end = before == present.len();
        let reason = say!("listed in {METADATA_NAME}, but the file does not exist");
        losses.push(LostRange {
            first_time_ns: contents.map(|contents| contents.span_ns.0),
            // what follows the last file is not known
            last_time_ns: contents
                .filter(|_| !is_at_end)
                .map(|contents| contents.span_ns.1),
            message_count: contents.and_then(|contents| contents.message_count),
            ..LostRange::of(LostPart::File, &folder.join(name), 0..0, reason)
        });
    }
    Ok(present)
}

/// The path of a listed file, which may have been compressed afterwards.
///
/// Up to version 3 of the metadata, names begin with the folder that the recorder wrote to,
/// `folder/file.db3`; the folder may have been renamed since. A file of that name in a subfolder comes
/// first.
fn present_file(folder: &Path, source: &Source, name: &str) -> PathBuf {
    let of_older_version = Path::new(name).file_name().and_then(|name| name.to_str());
    let names = [Some(name), of_older_version];
    let candidates = names.into_iter().flatten();
    let paths = candidates.flat_map(|name| {
        let packed = PACKED.map(|ending| folder.join(format!("{name}{ending}")));
        std::iter::once(folder.join(name)).chain(packed)
    });
    let mut present = paths.filter(|path| source.is_file(path));
    present.next().unwrap_or_else(|| folder.join(name))
}

fn refuse_compression(folder: &Path, metadata: &Metadata) -> Result<(), Error> {
    if metadata.compression_format.is_empty() || is_zstd(metadata) {
        return Ok(());
    }
    let Metadata {
        compression_format,
        compression_mode,
        ..
    } = metadata;
    Err(Error::Unsupported {
        path: folder.to_path_buf(),
        format: format!(
            "rosbag2 compression {compression_format} of mode {compression_mode} \
             (only zstd is supported)"
        ),
    })
}

fn is_zstd(metadata: &Metadata) -> bool {
    metadata.compression_format.eq_ignore_ascii_case("zstd")
}

/// All files of a known log format, in natural order of path; subfolders are searched only if the
/// folder itself has none.
fn log_files_below(folder: &Path, source: &Source, levels: usize) -> Result<Vec<PathBuf>, Error> {
    let (mut files, folders) = source.children(folder)?;
    files.retain(|path| {
        let content = source.content_of(path);
        content.is_ok_and(|content| content.is_log())
    });
    if files.is_empty() && levels > 0 {
        for folder in folders {
            files.extend(log_files_below(&folder, source, levels - 1)?);
        }
    }
    let text = |path: &Path| path.to_string_lossy().into_owned();
    files.sort_by(|left, right| natural_order(&text(left), &text(right)));
    Ok(files)
}

/// The found files without the copies of others: of a file and its packed form the listed one is read, or else the unpacked one.
fn without_copies(found: Vec<PathBuf>, listed: &[PathBuf], losses: &mut Losses) -> Vec<PathBuf> {
    let is_packed = |file: &&PathBuf| unpacked(file) != **file;
    let (packed, plain): (Vec<&PathBuf>, Vec<&PathBuf>) = found.iter().partition(is_packed);
    let mut originals: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    for file in listed.iter().chain(plain).chain(packed) {
        originals.entry(unpacked(file)).or_insert(file);
    }
    let mut kept = Vec::new();
    for file in &found {
        match originals.get(&unpacked(file)) {
            Some(&original) if original != file && !listed.contains(file) => losses.note(say!(
                "{} is a copy of {}: not read",
                name_of(file),
                name_of(original)
            )),
            _ => kept.push(file.clone()),
        }
    }
    kept
}

/// Without metadata only the file names show whether files are parts of one log.
fn refuse_several_logs(folder: &Path, files: &[PathBuf]) -> Result<(), Error> {
    let stems: BTreeSet<String> = files.iter().map(|file| stem_without_number(file)).collect();
    if stems.len() < 2 {
        return Ok(());
    }
    let below = |file: &PathBuf| {
        let path = file.strip_prefix(folder).unwrap_or(file);
        path.to_string_lossy().into_owned()
    };
    let names = files.iter().map(below).collect();
    Err(Error::SeveralLogs {
        path: folder.to_path_buf(),
        names,
    })
}

/// The parts that the numbers in the names leave out, each with the file behind it; without metadata nothing else tells of them. A
/// file of such a number that is no log is damaged, and not missing.
fn left_out(
    files: &[PathBuf],
    source: &Source,
    losses: &Losses,
) -> Result<Vec<(usize, LostRange)>, Error> {
    let numbers: Option<Vec<u64>> = files.iter().map(|file| number_of(file)).collect();
    let numbers = numbers.unwrap_or_default();
    let mut left_out = Vec::new();
    for (pair, (before, behind)) in numbers.windows(2).zip(files.iter().zip(1_usize..)) {
        let mut missing = pair[1].saturating_sub(pair[0]).saturating_sub(1);
        if missing == 0 {
            continue;
        }
        let is_part = |file: &&PathBuf| {
            let number = number_of(file).filter(|number| pair[0] < *number && *number < pair[1]);
            number.is_some()
                && stem_without_number(file) == stem_without_number(before)
                && unpacked(file).extension() == unpacked(before).extension()
        };
        let (beside, _) = source.children(before.parent().unwrap_or(before))?;
        for file in beside.iter().filter(is_part) {
            missing = missing.saturating_sub(1);
            let is_told = losses.ranges.iter().any(|lost| lost.file == *file);
            if let Some(error) = source.format_of(file).err().filter(|_| !is_told) {
                let bytes = 0..source.bytes(file);
                let lost = LostRange::of(LostPart::File, file, bytes, error.to_string());
                left_out.push((behind, lost));
            }
        }
        if missing > 0 {
            let told = say!(
                "files are missing before it, by the numbers in the names: {missing} after {}",
                name_of(before)
            );
            let lost = LostRange::of(LostPart::File, &files[behind], 0..0, told);
            left_out.push((behind, lost));
        }
    }
    Ok(left_out)
}

/// The listed files, and those in the folder whose names continue theirs: a recorder that was killed lists only the parts that it
/// had finished. Other logs are not read.
fn with_parts_behind(
    mut listed: Vec<PathBuf>,
    found: &[PathBuf],
    losses: &mut Losses,
) -> Vec<PathBuf> {
    let stems: BTreeSet<String> = listed
        .iter()
        .map(|file| stem_without_number(file))
        .collect();
    let unlisted: Vec<&PathBuf> = found.iter().filter(|file| !listed.contains(file)).collect();
    for file in unlisted {
        let is_part = stems.contains(&stem_without_number(file));
        let done = match is_part {
            true => word!("read as a part of the log, because its name continues the others"),
            false => word!("not read"),
        };
        losses.note(say!(
            "{} is not listed in {METADATA_NAME}: {done}",
            name_of(file)
        ));
        listed.extend(is_part.then(|| file.clone()));
    }
    listed
}

/// The format of all files. Files that are not logs are reported as lost, provided at least one is
/// a log.
fn common_format(
    folder: &Path,
    source: &Source,
    files: &mut Vec<PathBuf>,
    losses: &mut Losses,
) -> Result<Format, Error> {
    let mut formats = Vec::new();
    let mut unreadable = Vec::new();
    for file in std::mem::take(files) {
        match source.format_of(&file) {
            Ok(format) => {
                formats.push(format);
                files.push(file);
            }
            Err(error) => unreadable.push((file, error)),
        }
    }
    let Some(&format) = formats.first() else {
        let nothing = Error::NotALog {
            path: folder.to_path_buf(),
            found: "a folder without any such file".to_owned(),
        };
        let first = unreadable.into_iter().next();
        return Err(first.map_or(nothing, |(_, error)| error));
    };
    for (file, error) in unreadable {
        let bytes = source.bytes(&file);
        losses.lose(LostPart::File, &file, 0..bytes, error.to_string());
    }
    if formats.iter().any(|other| *other != format) {
        let names = files.iter().map(|file| name_of(file)).collect();
        return Err(Error::SeveralLogs {
            path: folder.to_path_buf(),
            names,
        });
    }
    Ok(format)
}

fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// `drive_12.mcap` and `drive_3.mcap` are parts of `drive`, and so are `drive_2026-05-28-22-26-40_0.bag` and the next one, whose
/// date is that of its own beginning, and a bag that is still written.
fn stem_without_number(path: &Path) -> String {
    let stem = stem_of(path);
    let bare = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    match bare.strip_suffix('_') {
        Some(bare) if bare.len() + 1 < stem.len() => without_date(bare).to_owned(),
        _ => stem,
    }
}

/// Returns the name without the endings that state how the file is stored.
fn stem_of(path: &Path) -> String {
    let name = name_of(&unpacked(path));
    let name = name.strip_suffix(".active").unwrap_or(&name);
    let stem = Path::new(name).file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The path without the ending of a file that was compressed after the recording.
fn unpacked(path: &Path) -> PathBuf {
    let name = name_of(path);
    let bare = PACKED.iter().find_map(|ending| name.strip_suffix(ending));
    path.with_file_name(bare.unwrap_or(&name))
}

/// The number at the end of a name, by which parts are counted. Six digits and more are a date or a time of day.
fn number_of(path: &Path) -> Option<u64> {
    const MOST_DIGITS: usize = 5;
    let stem = stem_of(path);
    let (_, digits) = stem.rsplit_once('_')?;
    (digits.len() <= MOST_DIGITS).then(|| digits.parse().ok())?
}

/// The name of a bag without `_2026-05-28-22-26-40`.
fn without_date(stem: &str) -> &str {
    const DATE: &str = "_0000-00-00-00-00-00";
    let is_date = |text: &str| {
        let mut pairs = text.bytes().zip(DATE.bytes());
        pairs.all(|(c, pattern)| c == pattern || pattern == b'0' && c.is_ascii_digit())
    };
    (stem.len().checked_sub(DATE.len()))
        .and_then(|at| stem.split_at_checked(at))
        .filter(|(_, date)| is_date(date))
        .map_or(stem, |(bare, _)| bare)
}

/// Compares digits by value, so that `_10` comes after `_9`.
fn natural_order(left: &str, right: &str) -> Ordering {
    let (mut left, mut right) = (left, right);
    loop {
        let (left_number, left_rest) = split_number(left);
        let (right_number, right_rest) = split_number(right);
        if !left_number.is_empty() && !right_number.is_empty() {
            let by_value = compare_numbers(left_number, right_number);
            if by_value.is_ne() {
                return by_value;
            }
            (left, right) = (left_rest, right_rest);
            continue;
        }
        let mut left_chars = left.chars();
        let mut right_chars = right.chars();
        match (left_chars.next(), right_chars.next()) {
            (Some(a), Some(b)) if a == b => {
                (left, right) = (left_chars.as_str(), right_chars.as_str());
            }
            (a, b) => return a.cmp(&b),
        }
    }
}

fn split_number(text: &str) -> (&str, &str) {
    let end = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    text.split_at(end)
}

fn compare_numbers(left: &str, right: &str) -> Ordering {
    let (short_left, short_right) = (left.trim_start_matches('0'), right.trim_start_matches('0'));
    short_left
        .len()
        .cmp(&short_right.len())
        .then_with(|| short_left.cmp(short_right))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_log_share_a_name() {
        for (name, log) in [
            ("a/drive_12.mcap", "drive"),
            ("a/drive12.mcap", "drive12"),
            ("_7.mcap", ""),
            ("drive_3.db3.zstd", "drive"),
            ("drive_3.mcap.gz", "drive"),
            ("drive_2026-05-28-22-26-40_0.bag", "drive"),
            ("drive_2026-05-28-22-26-42_1.bag.active", "drive"),
            ("drive_2026-05-28.bag", "drive_2026-05-28"),
            ("12.bag", "12"),
            ("ä_2026-05-28-22-26-4ä_1.bag", "ä_2026-05-28-22-26-4ä"),
        ] {
            assert_eq!(stem_without_number(Path::new(name)), log, "{name}");
        }
    }

    #[test]
    fn parts_are_ordered_by_number() {
        let mut names = ["log_10.mcap", "log_9.mcap", "log_0.mcap", "log_010b.mcap"];
        names.sort_by(|left, right| natural_order(left, right));
        assert_eq!(
            names,
            ["log_0.mcap", "log_9.mcap", "log_10.mcap", "log_010b.mcap"]
        );
    }
}
