// SPDX-License-Identifier: Apache-2.0
#include "record/import/importer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "base/edit_distance.hpp"
#include "record/import/file_reader.hpp"
#include "record/import/number_text.hpp"
#include "base/text.hpp"

namespace loopwarden::record {

namespace {

namespace fs = std::filesystem;

constexpr const char* kStandardInput = "standard input";
constexpr std::uintmax_t kLargestFixedBytes = 64UL * 1024UL * 1024UL;

// The rest of `source` in a file without a name, to be read again.
std::shared_ptr<std::FILE> spooled(TextSource& source) {
  std::shared_ptr<std::FILE> file(std::tmpfile(), [](std::FILE* f) {
    if (f != nullptr) std::fclose(f);
  });
  bool good = file != nullptr;
  std::string_view line;
  while (good && source.next(line)) {
    good = std::fwrite(line.data(), 1, line.size(), file.get()) == line.size() &&
           std::fputc('\n', file.get()) != EOF;
  }
  if (!good || std::fflush(file.get()) != 0) {
    throw RecordError(RecordError::Kind::io, 0, 0,
                      fmt::format("{}: a row a value is read twice, and its copy in the folder for "
                                  "temporary files can't be written: {}",
                                  source.name(), base::error_text(errno)));
  }
  return file;
}

std::string file_tag(const fs::path& path) {
  if (path == "-") return kStandardInput;
  fs::path stem = path.filename();
  if (stem.extension() == ".gz") stem = stem.stem();
  return stem.stem().string();
}

bool looks_like_export(const fs::path& path) {
  fs::path name = path.filename();
  if (base::lower_case(name.extension().string()) == ".gz") name = name.stem();
  const std::string extension = base::lower_case(name.extension().string());
  return extension == ".csv" || extension == ".txt" || extension == ".tsv" || extension == ".dat";
}

std::string list_of(const std::vector<FoundLoop>& loops) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t k = 0; k < std::min(loops.size(), kMost); ++k)
    text += (k > 0 ? ", " : "") + loops[k].tag;
  return loops.size() > kMost ? text + ", ..." : text;
}

// Puts the signals of several files one behind the other, those that begin first first.
Signals joined(std::vector<ImportPart>& parts) {
  if (parts.size() == 1) return std::move(parts.front().signals);
  std::sort(parts.begin(), parts.end(), [](const ImportPart& a, const ImportPart& b) {
    return a.origin->since(*b.origin) < 0.0;
  });
  Signals all;
  const TimePoint first = *parts.front().origin;
  for (std::size_t role = 0; role < kRoles; ++role) {
    Signal& to = all[role];
    for (ImportPart& part : parts) {
      Signal& from = part.signals[role];
      if (from.empty()) continue;
      if (!to.time_s) to.time_s = std::make_shared<std::vector<double>>();
      const double offset = part.origin->since(first);
      for (std::size_t k = 0; k < from.value.size(); ++k) {
        const double at = (*from.time_s)[k] + offset;
        // What two files both have counts once.
        if (!to.time_s->empty() && at <= to.time_s->back()) continue;
        to.time_s->push_back(at);
        to.value.push_back(from.value[k]);
      }
      to.bad += from.bad;
      to.questionable += from.questionable;
    }
  }
  return all;
}

using Endings = std::map<std::string, std::size_t>;

std::string endings_text(const Endings& endings) {
  std::string text;
  for (const auto& [ending, count] : endings) {
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ",
                        ending.empty() ? "without an ending" : ending, count);
  }
  return text;
}

std::vector<fs::path> exports_in(const fs::path& folder, Endings& passed_over) {
  std::vector<fs::path> found;
  Endings others;
  std::error_code problem;
  for (fs::recursive_directory_iterator
           it(folder, fs::directory_options::skip_permission_denied, problem),
       end;
       !problem && it != end; it.increment(problem)) {
    std::error_code none;
    const fs::path name = it->path().filename();
    if (!it->is_regular_file(none) || name.string().starts_with(".")) continue;
    if (looks_like_export(name)) {
      found.push_back(it->path());
    } else {
      ++others[base::lower_case(name.extension().string())];
    }
  }
  if (problem) {
    throw RecordError(RecordError::Kind::io, 0, 0,
                      fmt::format("{}: can't be read: {}", folder.string(), problem.message()));
  }
  if (found.empty()) {
    throw RecordError(
        RecordError::Kind::data, 0, 0,
        fmt::format("{}: no file .csv, .txt, .tsv, .dat or .gz of these{}", folder.string(),
                    others.empty() ? "" : "; passed over: " + endings_text(others)));
  }
  for (const auto& [ending, count] : others) passed_over[ending] += count;
  std::sort(found.begin(), found.end());
  return found;
}

// Empty: none is near.
std::string nearest(const std::vector<std::string>& names, const std::string& wanted) {
  constexpr std::size_t kMost = 60;  // characters that are compared
  std::string near;
  std::size_t best = wanted.size() / 2 + 1;
  for (const std::string& name : names) {
    const std::size_t distance = base::edit_distance(base::lower_case(name.substr(0, kMost)),
                                                     base::lower_case(wanted.substr(0, kMost)));
    if (!name.empty() && distance < best) {
      best = distance;
      near = name;
    }
  }
  return near;
}

// The column or tag that `wanted` means: by its name, its name without the unit, or its number. Throws RecordError.
std::string name_meant(const std::vector<std::string>& names, const std::string& wanted,
                       const std::string& file) {
  for (const std::string& name : names) {
    if (name == wanted || base::lower_case(name) == base::lower_case(wanted)) return name;
  }
  for (const std::string& name : names) {
    const std::size_t bracket = name.find_last_of("([");
    if (bracket != std::string::npos && base::trimmed(name.substr(0, bracket)) == wanted)
      return name;
  }
  if (const auto number = parse_number(wanted, '.');
      number && *number >= 1.0 && *number <= static_cast<double>(names.size())) {
    return names[static_cast<std::size_t>(*number) - 1];
  }
  const std::string near = nearest(names, wanted);
  throw RecordError(RecordError::Kind::data, 0, 0,
                    fmt::format("{}: no column or tag {}{}", file, base::in_quotes(wanted),
                                near.empty() ? near : "; is it " + base::in_quotes(near) + "?"));
}

}  // namespace

Importer::Importer(const std::vector<fs::path>& paths, ImportOptions options, bool lenient,
                   const ImportProgress& progress)
    : options_(std::move(options)) {
  std::vector<std::pair<fs::path, bool>> files;  // and whether it must be an export
  for (const fs::path& path : paths) {
    std::error_code none;
    if (path == "-" || !fs::is_directory(path, none)) {
      files.emplace_back(path, !lenient);
      continue;
    }
    for (fs::path& found : exports_in(path, passed_over_))
      files.emplace_back(std::move(found), false);
  }
  for (std::size_t k = 0; k < files.size(); ++k) {
    look_at(files[k].first, files[k].second, [&](double share) {
      if (progress) progress((static_cast<double>(k) + share) / static_cast<double>(files.size()));
    });
  }
  if (clashes_.empty()) return;
  constexpr std::size_t kMost = 8;
  std::string text;
  std::size_t shown = 0;
  for (const std::string& clash : clashes_) {
    if (shown++ < kMost) text += (text.empty() ? "" : "\n") + clash;
  }
  if (shown > kMost) text += fmt::format("\nand {} more", shown - kMost);
  throw RecordError(RecordError::Kind::data, 0, 0, text);
}

void Importer::look_at(const fs::path& path, bool named, const ImportProgress& progress) {
  try {
    auto text = std::make_unique<TextSource>(path, options_.encoding);
    const std::string_view head = text->peek(kHeadLines);
    Source source;
    source.layout = find_layout(head, text->name(), options_);
    source.layout_text = describe(source.layout, *text);
    const auto lines = static_cast<double>(
        std::max<std::ptrdiff_t>(1, std::count(head.begin(), head.end(), '\n')));
    source.rows = static_cast<std::uint64_t>(static_cast<double>(text->text_bytes()) /
                                             (static_cast<double>(head.size()) / lines));
    source.path = path;
    std::vector<std::string> names;
    if (!source.layout.is_long) {
      names = source.layout.names;
      if (source.layout.time < names.size()) names[source.layout.time].clear();
    }
    if (path == "-") {
      if (source.layout.is_long) {
        stdin_copy_ = spooled(*text);
      } else {
        stdin_ = std::move(text);
      }
    }
    if (source.layout.is_long) names = names_in(path, source.layout, progress);
    sources_.push_back(std::move(source));
    add_loops(sources_.size() - 1, names);
    progress(1.0);
  } catch (const RecordError& e) {
    if (named) throw;
    problems_.push_back({path.string(), e.what()});
  }
}

std::unique_ptr<TextSource> Importer::open(const fs::path& path) {
  if (path != "-") return std::make_unique<TextSource>(path, options_.encoding);
  if (stdin_copy_) {
    return std::make_unique<TextSource>(fmt::format("/proc/self/fd/{}", fileno(stdin_copy_.get())),
                                        Encoding::utf8, kStandardInput);
  }
  if (!stdin_)
    throw RecordError(RecordError::Kind::io, 0, 0, "standard input: can be read once only");
  return std::move(stdin_);
}

std::string Importer::name_of(std::size_t file) const {
  const fs::path& path = sources_[file].path;
  return path == "-" ? kStandardInput : path.string();
}

std::vector<std::string> Importer::names_in(const fs::path& path, const Layout& layout,
                                            const ImportProgress& progress) {
  const std::unique_ptr<TextSource> text = open(path);
  TextSource& source = *text;
  std::vector<std::string> names;
  std::set<std::string, std::less<>> known;
  std::string_view line;
  LineCells cells;
  for (std::size_t k = 0; k < layout.header_rows; ++k) source.next(line);
  std::string last;
  std::string buffer;
  while (source.next(line)) {
    if (source.line_number() % kProgressRows == 0) progress(source.share_read());
    if (!cells.split(line, layout.delimiter)) continue;
    const std::string_view name = tag_of(layout, cells, buffer);
    if (name == last || name.empty()) continue;
    last = name;
    if (known.insert(last).second) names.push_back(last);
  }
  return names;
}

std::vector<LoopSignals> Importer::asked_for(std::size_t file,
                                             const std::vector<std::string>& names) const {
  std::vector<LoopSignals> found;
  for (LoopSignals loop : options_.loops) {
    try {
      for (std::string& name : loop.names) {
        if (!name.empty()) name = name_meant(names, name, name_of(file));
      }
      found.push_back(std::move(loop));
    } catch (const RecordError&) {
      // Of several loops each may have its own file.
      if (options_.loops.size() == 1) throw;
    }
  }
  return found;
}

void Importer::take_units(std::size_t file, LoopSignals& signals) const {
  const Layout& layout = sources_[file].layout;
  if (layout.is_long) return;
  for (std::size_t role = 0; role < kRoles; ++role) {
    const std::string& name = signals.names[role];
    if (name.empty() || !signals.units[role].empty()) continue;
    for (std::size_t c = 0; c < layout.names.size(); ++c) {
      if (layout.names[c] == name) signals.units[role] = layout.units[c];
    }
  }
}

// A loop whose times are absolute goes on in the next file.
void Importer::add_loop(std::size_t file, LoopSignals signals) {
  const std::string tag = signals.tag.empty() ? file_tag(sources_[file].path) : signals.tag;
  const auto [at, is_new] = by_tag_.try_emplace(tag, loops_.size());
  FoundLoop* same = is_new ? nullptr : &loops_[at->second];
  const bool goes_on = same != nullptr && !signals.tag.empty() &&
                       is_absolute(sources_[file].layout.form) &&
                       is_absolute(sources_[same->files.front()].layout.form);
  if (!goes_on) {
    FoundLoop loop{.signals = std::move(signals), .tag = tag, .files = {file}};
    if (same != nullptr) loop.tag += " in " + file_tag(sources_[file].path);
    loops_.push_back(std::move(loop));
    return;
  }
  same->files.push_back(file);
  join(*same, signals);
}

void Importer::join(FoundLoop& same, const LoopSignals& signals) {
  LoopSignals& of = same.signals;
  for (std::size_t role = 0; role < kRoles; ++role) {
    const std::string& name = signals.names[role];
    if (of.names[role].empty()) {
      of.names[role] = name;
      of.units[role] = signals.units[role];
      of.ruled_by[role] = signals.ruled_by[role];
      of.ranges[role] = signals.ranges[role];
    } else if (!name.empty() && name != of.names[role] &&
               !(of.ruled_by[role].empty() && signals.ruled_by[role].empty())) {
      clashes_.insert(clash_text(same.tag, static_cast<Role>(role), of.names[role],
                                 of.ruled_by[role], name, signals.ruled_by[role]));
    }
  }
  if (of.kind.empty()) of.kind = signals.kind;
  if (!of.mode_words) of.mode_words = signals.mode_words;
}

void Importer::add_loops(std::size_t file, const std::vector<std::string>& names) {
  std::set<std::string> used;
  const auto clash = [this](std::string text) { clashes_.insert(std::move(text)); };
  for (LoopSignals& signals : options_.loops.empty()
                                  ? find_loops(names, options_.rules, rule_use_, clash)
                                  : asked_for(file, names)) {
    used.insert(signals.names.begin(), signals.names.end());
    take_units(file, signals);
    add_loop(file, std::move(signals));
  }
  for (const std::string& name : names) {
    if (name.empty() || used.count(name) > 0) continue;
    const std::optional<RuledTag> ruled = rule_for(options_.rules, name);
    if (!ruled || !options_.rules[ruled->rule].unused) other_names_.push_back(name);
  }
}

std::vector<std::string> Importer::idle_rules() const {
  std::vector<std::string> idle;
  for (std::size_t k = 0; k < options_.rules.size(); ++k) {
    const bool seen = k < rule_use_.size();
    if (seen && rule_use_[k].decided) continue;
    const TagRule& rule = options_.rules[k];
    const std::string why = seen && rule_use_[k].earlier
                                ? "decides nothing: what it matches is decided by " +
                                      options_.rules[*rule_use_[k].earlier].place
                                : "matches no column or tag";
    idle.push_back(fmt::format("{}: {} {}", rule.place, base::in_quotes(rule.pattern.text()), why));
  }
  return idle;
}

std::uint64_t Importer::bytes_of(std::size_t loop) const {
  std::uint64_t bytes = 0;
  for (const std::size_t file : loops_[loop].files) {
    std::uint64_t columns = 1;
    for (const std::string& name : loops_[loop].signals.names)
      columns += static_cast<std::uint64_t>(!name.empty());
    bytes += columns * sources_[file].rows * sizeof(double);
  }
  return bytes;
}

std::string Importer::passed_over_text() const {
  std::size_t files = 0;
  for (const auto& [ending, count] : passed_over_) files += count;
  if (files == 0) return {};
  return fmt::format("{} {} passed over: {}", files, files == 1 ? "file" : "files",
                     endings_text(passed_over_));
}

std::string Importer::no_pv() const {
  constexpr std::size_t kMost = 6;
  std::string names;
  for (std::size_t k = 0; k < std::min(kMost, other_names_.size()); ++k)
    names += (k > 0 ? ", " : " among ") + base::in_quotes(other_names_[k]);
  return "no column or tag that is a PV by its name" + names +
         "; --map pv=NAME,co=NAME,sp=NAME tells";
}

Imported Importer::finished(std::size_t loop, std::vector<ImportPart>& pieces) const {
  const FoundLoop& of = loops_[loop];
  const std::string first = name_of(of.files.front());
  const std::string place =
      first + (of.signals.tag.empty() ? std::string() : ": " + of.signals.tag);
  std::erase_if(pieces, [](const ImportPart& part) {
    return std::all_of(part.signals.begin(), part.signals.end(),
                       [](const Signal& s) { return s.empty(); });
  });
  if (pieces.empty()) throw RecordError(RecordError::Kind::data, 0, 0, place + ": no values");
  const Source& source = sources_[of.files.front()];
  ImportNotes notes;
  notes.tag = of.tag;
  notes.files = first;
  if (of.files.size() > 1) notes.files += fmt::format(" and {} more", of.files.size() - 1);
  notes.names = of.signals.names;
  notes.units = of.signals.units;
  notes.ranges = of.signals.ranges;
  notes.kind = of.signals.kind;
  notes.layout = source.layout_text;
  if (!source.layout.hint.empty()) notes.remarks.push_back(source.layout.hint);
  for (const ImportPart& part : pieces) {
    if (part.shifted_hours > 0)
      notes.remarks.emplace_back("the clock fell back by an hour: taken as the end of summer time");
    for (std::size_t role = 0; role < kRoles; ++role) {
      const Signal& signal = part.signals[role];
      if (signal.word_cells == 0) continue;
      notes.remarks.push_back(fmt::format("{}: {} in {} {}: taken as a bad value",
                                          of.signals.names[role], base::in_quotes(signal.word),
                                          signal.word_cells,
                                          signal.word_cells == 1 ? "cell" : "cells"));
    }
  }
  Signals signals = joined(pieces);  // sorts
  notes.start = pieces.front().origin;
  if (of.signals.has(Role::pv) && signals[index_of(Role::pv)].empty()) {
    throw RecordError(RecordError::Kind::data, 0, 0, place + ": no values of PV");
  }
  pieces.clear();
  pieces.shrink_to_fit();
  Imported imported = on_constant_period(std::move(signals), options_, std::move(notes), place);
  // Time 0 is the first sample where the wall clock tells the rest.
  const double begin_s = imported.record.time_s.front();
  if (imported.notes.start && begin_s != 0.0) {
    const double whole = std::floor(imported.notes.start->rest_s + begin_s);
    imported.notes.start->whole_s += static_cast<std::int64_t>(whole);
    imported.notes.start->rest_s += begin_s - whole;
    for (double& t : imported.record.time_s) t -= begin_s;
  }
  return imported;
}

void Importer::read(std::span<const std::size_t> which, const TakeLoop& take, const FailLoop& fail,
                    const ImportProgress& progress) {
  std::map<std::size_t, std::vector<ImportPart>> parts;  // by loop
  std::map<std::size_t, Feed> feeds;                     // by file
  for (const std::size_t loop : which) {
    const FoundLoop& of = loops_[loop];
    parts[loop].resize(of.files.size());
    for (std::size_t k = 0; k < of.files.size(); ++k)
      feeds[of.files[k]].add(parts[loop][k], of.signals, sources_[of.files[k]].layout);
  }
  std::size_t done = 0;
  for (auto& [file, feed] : feeds) {
    try {
      read_into(
          feed, *open(sources_[file].path), sources_[file].layout, options_, [&](double share) {
            if (progress)
              progress((static_cast<double>(done) + share) / static_cast<double>(feeds.size()));
          });
    } catch (const RecordError& e) {
      for (ImportPart* part : feed.parts) part->error = e;
    }
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(feeds.size()));
  }
  for (const std::size_t loop : which) {
    const std::vector<std::size_t>& files = loops_[loop].files;
    std::vector<ImportPart>& pieces = parts[loop];
    for (std::size_t k = 0; k < files.size(); ++k) {
      if (pieces[k].error) fail(loop, files[k], *pieces[k].error);
    }
    std::erase_if(pieces, [](const ImportPart& part) { return part.error.has_value(); });
    if (pieces.empty()) continue;
    std::optional<Imported> imported;
    try {
      imported = finished(loop, pieces);
    } catch (const RecordError& e) {
      fail(loop, files.front(), e);
      continue;
    }
    take(loop, std::move(*imported));
  }
}

Imported Importer::read_one(std::size_t loop, const ImportProgress& progress) {
  Imported out;
  const std::array<std::size_t, 1> which{loop};
  read(
      which, [&](std::size_t, Imported imported) { out = std::move(imported); },
      [](std::size_t, std::size_t, const RecordError& e) { throw e; }, progress);
  return out;
}

Imported import_record(const fs::path& path, const std::string& loop, const ImportOptions& options,
                       const ImportProgress& progress) {
  // In the fixed format with times from anywhere: as it always was, errors included.
  std::optional<RecordError> fixed_error;
  std::error_code problem;
  const std::uintmax_t size = fs::file_size(path, problem);
  if (path != "-" && loop.empty() && !options.anything_said() && !problem &&
      size <= kLargestFixedBytes) {
    try {
      Imported out{read_record(path), {}};
      const double first_s = out.record.time_s.front();
      constexpr double kEpoch = 1e8;
      if (first_s < kEpoch) {
        out.notes.tag = file_tag(path);
        out.notes.files = path.string();
        out.notes.period_s = out.record.period_s;
        recognise_archive(out.record, options, out.notes);
        const std::string hint = other_time_units(out.record.period_s);
        if (!hint.empty()) out.notes.remarks.push_back(hint);
        return out;
      }
    } catch (const RecordError& e) {
      if (e.kind() == RecordError::Kind::io) throw;
      fixed_error = e;
    }
  }
  try {
    Importer importer({path}, options);
    const auto read = [&](std::size_t which) {
      Imported out = importer.read_one(which, progress);
      if (std::string others = importer.passed_over_text(); !others.empty())
        out.notes.remarks.push_back(std::move(others));
      return out;
    };
    std::vector<std::size_t> usable;
    for (std::size_t k = 0; k < importer.loops().size(); ++k) {
      if (importer.loops()[k].signals.has(Role::pv)) usable.push_back(k);
    }
    const auto fail = [&](const std::string& what) {
      throw RecordError(RecordError::Kind::data, 0, 0, fmt::format("{}: {}", path.string(), what));
    };
    if (!loop.empty()) {
      for (const std::size_t k : usable) {
        if (base::lower_case(importer.loops()[k].tag) == base::lower_case(loop)) return read(k);
      }
      fail(fmt::format("no loop {}; it has {}", base::in_quotes(loop), list_of(importer.loops())));
    }
    if (usable.empty()) fail(importer.no_pv());
    // Of several the one that can be judged, where it is one.
    std::vector<std::size_t> complete;
    for (const std::size_t k : usable) {
      if (importer.loops()[k].signals.has(Role::co)) complete.push_back(k);
    }
    if (complete.size() == 1) return read(complete.front());
    if (usable.size() > 1) {
      fail(fmt::format("{} loops ({}); --loop TAG takes one, 'loopwarden survey' all of them",
                       usable.size(), list_of(importer.loops())));
    }
    return read(usable.front());
  } catch (const RecordError& e) {
    // Both have read it; the one that came further knows more.
    if (fixed_error && e.line() == 0 && fixed_error->line() > 1) throw *fixed_error;
    throw;
  }
}

}  // namespace loopwarden::record
