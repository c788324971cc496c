// SPDX-License-Identifier: Apache-2.0
#include "record/import/importer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <set>
#include <utility>

#include "base/edit_distance.hpp"
#include "record/import/file_reader.hpp"
#include "record/import/line_protocol.hpp"
#include "record/import/number_text.hpp"
#include "record/import/quality_columns.hpp"
#include "record/import/time_units.hpp"
#include "record/import/units.hpp"
#include "base/text.hpp"

namespace loopwarden::record {

namespace {

namespace fs = std::filesystem;

constexpr const char* kStandardInput = "standard input";
constexpr std::uintmax_t kLargestFixedBytes = 64UL * 1024UL * 1024UL;

// Copies the rest of `source` to a temporary file without a name, so that it can be read again.
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
                      fmt::format("{}: a table with one row per value is read twice, but its "
                                  "temporary copy can't be written: {}",
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

std::string ending_of(const fs::path& path) { return base::lower_case(path.extension().string()); }

bool is_one_of(const std::string& ending, std::initializer_list<const char*> endings) {
  return std::any_of(endings.begin(), endings.end(),
                     [&](const char* one) { return ending == one; });
}

bool is_text(const fs::path& path) {
  return is_one_of(ending_of(path), {".csv", ".txt", ".tsv", ".dat", ".lp"});
}
bool is_packed_text(const fs::path& path) {
  return ending_of(path) == ".gz" && is_text(path.filename().stem());
}
bool holds_files(const fs::path& path) {
  return is_one_of(ending_of(path), {".zip", ".xlsx", ".xlsm"});
}

// Returns why a file was skipped that is no export by its name.
std::string why_passed_over(const fs::path& path) {
  const std::string ending = ending_of(path);
  if (ending == ".json") return "JSON is not read: export the values as CSV";
  if (ending == ".pdf") return "a PDF holds no values that can be read: export them as CSV";
  if (is_one_of(ending, {".jpg", ".jpeg", ".png", ".gif", ".bmp", ".tif", ".tiff", ".svg"}))
    return "a picture";
  if (is_one_of(ending, {".doc", ".docx", ".odt", ".rtf", ".md", ".htm", ".html", ".ppt", ".pptx"}))
    return "a document";
  if (is_one_of(ending, {".xls", ".xlsb", ".ods"}))
    return "a workbook of another kind: save it as .xlsx or CSV";
  if (is_one_of(ending, {".7z", ".rar", ".tar", ".tgz", ".bz2", ".xz", ".zst", ".gz"}))
    return "an archive of another kind: unpack it, or make a .zip";
  if (is_one_of(ending, {".mat", ".h5", ".hdf5", ".parquet", ".db", ".sqlite", ".mdf", ".tdms"}))
    return "values in a form that is not read: export them as CSV";
  return "unknown file type (not .csv .txt .tsv .dat .zip .xlsx). Name the file on the command "
         "line to read it anyway";
}

std::string list_of(const std::vector<FoundLoop>& loops) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t k = 0; k < std::min(loops.size(), kMost); ++k)
    text += (k > 0 ? ", " : "") + loops[k].tag;
  return loops.size() > kMost ? text + ", ..." : text;
}

// Concatenates the signals of several files in the order of their start times.
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
        // Values that two files share count once.
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

// Returns an empty text if no name is similar.
std::string nearest(const std::vector<std::string>& names, const std::string& wanted) {
  constexpr std::size_t kMost = 60;  // number of characters compared
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

// Returns the column or tag that `wanted` refers to: by its name, its name without the unit, or its
// number. Throws RecordError.
std::string name_meant(const std::vector<std::string>& names, const std::string& wanted,
                       const std::string& file) {
  for (const std::string& name : names) {
    if (name == wanted || base::lower_case(name) == base::lower_case(wanted)) return name;
  }
  for (const std::string& name : names) {
    const std::size_t bracket = name.find_last_of("([");
    if (bracket != std::string::npos && base::trimmed(name.substr(0, bracket)) == wanted)
      return name;
    if (split_name(name).text == wanted) return name;
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

// Returns whether `name` consists of one or more whole parts of a tag: FIC-40B of
// Area1/FIC-40B/PID1.
bool has_part(const std::string& tag, const std::string& name) {
  constexpr std::string_view kBetween = "/.\\:";
  const auto apart = [&](std::size_t at) {
    return at >= tag.size() || kBetween.find(tag[at]) != std::string_view::npos;
  };
  const std::string whole = base::lower_case(tag);
  const std::string part = base::lower_case(name);
  for (std::size_t at = whole.find(part); at != whole.npos; at = whole.find(part, at + 1)) {
    if ((at == 0 || apart(at - 1)) && apart(at + part.size())) return true;
  }
  return false;
}

bool is_without_tag(const LoopSignals& loop) { return loop.tag.empty() && loop.has(Role::pv); }

bool is_mode_alone(const LoopSignals& loop) {
  return !loop.has(Role::pv) && !loop.has(Role::sp) && !loop.has(Role::co) && !loop.has(Role::stem);
}

}  // namespace

struct Importer::ToLookAt {
  fs::path path, on_disk;
  std::string tag;
  bool named = false;     // its errors are thrown
  bool is_sheet = false;  // skipped if empty
};

Importer::Importer(const std::vector<fs::path>& paths, ImportOptions options, bool lenient,
                   const ImportProgress& progress)
    : options_(std::move(options)) {
  std::vector<ToLookAt> files;
  for (const fs::path& path : paths) find_files(path, lenient, files);
  for (std::size_t k = 0; k < files.size(); ++k) {
    look_at(files[k], [&](double share) {
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

void Importer::find_files(const fs::path& path, bool lenient, std::vector<ToLookAt>& files) {
  try {
    std::error_code none;
    if (path != "-" && fs::is_directory(path, none)) {
      find_in_folder(path, files);
    } else if (path != "-" && is_container(path)) {
      find_in_container(path, files);
    } else {
      const auto container = path == "-" ? std::nullopt : container_of(path);
      files.push_back({path, container.value_or(path), file_tag(path), !lenient, false});
    }
  } catch (const RecordError& e) {
    if (!lenient) throw;
    problems_.push_back({path.string(), e.what(), e.kind()});
  }
}

void Importer::find_in_folder(const fs::path& folder, std::vector<ToLookAt>& files) {
  std::vector<fs::path> found;
  std::vector<fs::path> others;
  std::error_code problem;
  for (fs::recursive_directory_iterator
           it(folder, fs::directory_options::skip_permission_denied, problem),
       end;
       !problem && it != end; it.increment(problem)) {
    std::error_code none;
    const fs::path name = it->path().filename();
    if (!it->is_regular_file(none) || name.string().starts_with(".")) continue;
    const bool is_export = is_text(name) || is_packed_text(name) || holds_files(name);
    (is_export ? found : others).push_back(it->path());
  }
  if (problem)
    refuse(folder.string(), "can't be read: " + problem.message(), RecordError::Kind::io);
  std::sort(found.begin(), found.end());
  std::sort(others.begin(), others.end());
  for (const fs::path& path : others)
    passed_over_.push_back({path.string(), why_passed_over(path)});
  if (found.empty()) {
    refuse(folder.string(), "no file .csv, .txt, .tsv, .dat (also .gz), .zip or .xlsx" +
                                (others.empty() ? "" : "\n" + passed_over_text()));
  }
  for (const fs::path& path : found) {
    if (!holds_files(path)) {
      files.push_back({path, path, file_tag(path), false, false});
      continue;
    }
    try {
      find_in_container(path, files);
    } catch (const RecordError& e) {
      problems_.push_back({path.string(), e.what(), e.kind()});
    }
  }
}

void Importer::find_in_container(const fs::path& path, std::vector<ToLookAt>& files) {
  if (!is_container(path)) {
    containers_.open(path, Encoding::automatic);  // throws an error that names the actual format
    refuse(path.string(), "is no archive and no workbook");
  }
  std::set<fs::path> known;
  std::size_t taken = 0;
  for (ContainerMember& member : containers_.members(path)) {
    const std::string name = member.path.filename().string();
    const auto fail = [&](const std::string& why) {
      problems_.push_back({member.path.string(), member.path.string() + ": " + why});
    };
    if (member.is_sheet || is_text(name)) {
      if (!member.is_sheet && name.starts_with(".")) continue;
      ++taken;
      if (!known.insert(member.path).second) {
        fail("a second member of this name");
      } else {
        files.push_back({member.path, path, std::move(member.tag), false, member.is_sheet});
      }
    } else if (name.starts_with(".") ||
               member.path.string().find("/__MACOSX/") != std::string::npos) {
      continue;
    } else if (holds_files(name) || ending_of(name) == ".gz") {
      ++taken;
      fail("is packed within an archive, which is not read: unpack the outer one");
    } else {
      passed_over_.push_back({member.path.string(), why_passed_over(name)});
    }
  }
  if (taken == 0) refuse(path.string(), "contains no export");
}

// The text of a sheet or of line protocol was made by this program, so its format is known.
ImportOptions Importer::options_for(const TextSource& text) const {
  ImportOptions options = options_;
  if (text.packing() == kLineProtocol) {
    options.delimiter = '\t';
    options.decimal = '.';
  }
  if (text.packing() == "xlsx") {
    options.delimiter = '\t';
    options.counts_columns = true;
  }
  return options;
}

void Importer::look_at(const ToLookAt& file, const ImportProgress& progress) {
  const fs::path& path = file.path;
  try {
    auto text = path == "-" ? containers_.open(path, options_.encoding) : open(path);
    const std::string_view head = text->peek(kHeadLines);
    if (file.is_sheet && head.find('\t') == head.npos) {
      passed_over_.push_back(
          {path.string(), head.empty() ? "an empty sheet" : "a sheet of one column"});
      return;
    }
    Source source;
    source.layout = find_layout(head, text->name(), options_for(*text));
    source.layout_text = describe(source.layout, *text);
    if (!source.layout.assumed.empty())
      assumed_.push_back(path.string() + ": " + source.layout.assumed);
    const auto lines = static_cast<double>(
        std::max<std::ptrdiff_t>(1, std::count(head.begin(), head.end(), '\n')));
    source.rows = static_cast<std::uint64_t>(static_cast<double>(text->text_bytes()) /
                                             (static_cast<double>(head.size()) / lines));
    source.path = path;
    source.on_disk = file.on_disk;
    source.tag = file.tag;
    std::vector<std::string> names;
    if (!source.layout.is_long) {
      names = source.layout.names;
      if (source.layout.time < names.size()) names[source.layout.time].clear();
      for (const std::size_t column : quality_columns(source.layout)) names[column].clear();
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
    for (std::string& name : unused_columns(sources_.back().layout))
      other_names_.push_back(std::move(name));
    progress(1.0);
  } catch (const RecordError& e) {
    if (file.named) throw;
    problems_.push_back({path.string(), e.what(), e.kind()});
  }
}

std::unique_ptr<TextSource> Importer::open(const fs::path& path) {
  if (path != "-") return containers_.open(path, options_.encoding);
  if (stdin_copy_) {
    return std::make_unique<TextSource>(
        open_file(fmt::format("/proc/self/fd/{}", fileno(stdin_copy_.get())), kStandardInput),
        kStandardInput, Encoding::utf8);
  }
  if (!stdin_)
    throw RecordError(RecordError::Kind::io, 0, 0, "standard input: can be read once only");
  return std::move(stdin_);
}

std::string Importer::name_of(std::size_t file) const {
  const fs::path& path = sources_[file].path;
  return path == "-" ? kStandardInput : path.string();
}

std::vector<std::string> Importer::names_in(const fs::path& path, const Layout& first_table,
                                            const ImportProgress& progress) {
  Layout layout = first_table;
  const std::unique_ptr<TextSource> text = open(path);
  TextSource& source = *text;
  std::vector<std::string> names;
  std::set<std::string, std::less<>> known;
  std::string_view line;
  LineCells cells;
  std::string last;
  std::string buffer;
  while (source.next(line)) {
    if (source.line_number() % kProgressRows == 0) progress(source.share_read());
    if (source.line_number() <= layout.header_rows && !layout.annotated) continue;
    if (!cells.split(line, layout.delimiter)) continue;
    if (is_annotation(layout, cells)) take_annotation(layout, cells);
    if (source.line_number() <= layout.header_rows) continue;
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
      // With several loops, each may be in a different file.
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

// Adds a loop of a file. A loop with absolute times may continue in the next file.
void Importer::add_loop(std::size_t file, LoopSignals signals) {
  const std::string tag = signals.tag.empty() ? sources_[file].tag : signals.tag;
  const auto [at, is_new] = by_tag_.try_emplace(tag, loops_.size());
  FoundLoop* same = is_new ? nullptr : &loops_[at->second];
  const bool goes_on = same != nullptr && !signals.tag.empty() &&
                       is_absolute(sources_[file].layout.form) &&
                       is_absolute(sources_[same->files.front()].layout.form);
  if (!goes_on) {
    FoundLoop loop{.signals = std::move(signals), .tag = tag, .files = {file}};
    if (same != nullptr) {
      loop.tag += " in " + sources_[file].tag;
      // Files of the same name may be in several folders.
      for (int k = 2; !by_tag_.try_emplace(loop.tag, loops_.size()).second; ++k)
        loop.tag = fmt::format("{} in {} ({})", tag, sources_[file].tag, k);
    }
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
  std::vector<LoopSignals> found = options_.loops.empty()
                                       ? find_loops(names, options_.rules, rule_use_, clash)
                                       : asked_for(file, names);
  // The daemon's records contain "requested_mode" in addition to "pv". It is not a separate loop.
  if (std::any_of(found.begin(), found.end(), is_without_tag)) std::erase_if(found, is_mode_alone);
  for (LoopSignals& signals : found) {
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
  return record::idle_rules(options_.rules, rule_use_);
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
  constexpr std::size_t kMost = 5;
  struct Files {
    std::string names;
    std::size_t count = 0;
  };
  std::map<std::string, Files> by_reason;
  for (const FileProblem& file : passed_over_) {
    Files& files = by_reason[file.why];
    if (files.count++ < kMost) files.names += (files.names.empty() ? "" : ", ") + file.file;
  }
  std::string text;
  for (const auto& [why, files] : by_reason) {
    text += fmt::format("{}skipped: {}{}: {}", text.empty() ? "" : "\n", files.names,
                        files.count > kMost ? fmt::format(" and {} more", files.count - kMost) : "",
                        why);
  }
  return text;
}

std::string Importer::no_pv() const {
  constexpr std::size_t kMost = 6;
  std::string names;
  for (std::size_t k = 0; k < std::min(kMost, other_names_.size()); ++k)
    names += (k > 0 ? ", " : " in ") + base::in_quotes(other_names_[k]);
  const std::string hint = pairs_hint();
  return "no PV column found" + names + ". " +
         (hint.empty()
              ? "Name the columns with --map pv=NAME,co=NAME,sp=NAME, for a whole folder with "
                "--rules RULES.yaml"
              : hint);
}

// Finds pairs by ISA-5.1: the same letter of the measured variable and the same number.
std::string Importer::pairs_hint() const {
  std::map<std::string, std::string> transmitters;  // by the common parts of both names
  std::vector<std::pair<std::string, std::string>> pairs;
  const auto common = [](const InstrumentName& name) {
    return fmt::format("{}{}{}", name.before, name.measured, name.number);
  };
  for (const std::string& name : other_names_) {
    const auto instrument = instrument_name(name);
    if (instrument && instrument->is_transmitter()) transmitters.emplace(common(*instrument), name);
  }
  for (const std::string& name : other_names_) {
    const auto instrument = instrument_name(name);
    if (!instrument || !instrument->is_valve()) continue;
    const auto at = transmitters.find(common(*instrument));
    if (at == transmitters.end()) continue;
    pairs.emplace_back(at->second, name);
    transmitters.erase(at);
  }
  if (pairs.empty()) return {};
  const auto& [pv, co] = pairs.front();
  std::string text =
      fmt::format("If {} is PV and {} is CO, add: --map pv={},co={}", pv, co, pv, co);
  if (pairs.size() > 1) {
    text += fmt::format(
        ". There are {} more pairs. Name all of them with --rules and a pattern, or with --format "
        "and a list of loops",
        pairs.size() - 1);
  }
  return text;
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
    for (const std::string& remark : part.remarks) notes.remarks.push_back(remark);
    for (std::size_t role = 0; role < kRoles; ++role) {
      std::string& unit = notes.units[role];
      if (unit.empty()) unit = part.signals[role].unit;
      for (const auto& [word, cells] : part.signals[role].words)
        notes.words.push_back({name_of(part.file), of.signals.names[role], word, cells});
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
  // Time 0 is the first sample, if the absolute start time is known.
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
    for (std::size_t k = 0; k < of.files.size(); ++k) {
      parts[loop][k].file = of.files[k];
      feeds[of.files[k]].add(parts[loop][k], of.signals, sources_[of.files[k]].layout);
    }
  }
  std::size_t done = 0;
  for (auto& [file, feed] : feeds) {
    try {
      const std::unique_ptr<TextSource> text = open(sources_[file].path);
      read_into(feed, *text, sources_[file].layout, options_for(*text), [&](double share) {
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

namespace {

// Returns whether a file in the fixed format can be read directly: no column of qualities, no
// thousands marks, times in seconds.
bool is_plain(const fs::path& path, const Record& record) {
  TextSource text(open_file(path, path.string()), path.string());
  std::string_view header;
  LineCells cells;
  if (!text.next(header) || !cells.split(header, ',')) return false;
  Layout layout;
  layout.time = kNoColumn;
  layout.names.assign(cells.cells.begin(), cells.cells.end());
  const auto qualities = find_qualities(layout, {}, {});
  return std::all_of(qualities.begin(), qualities.end(),
                     [](const auto& list) { return list.empty(); }) &&
         !may_be_thousands(record.pv) && !may_be_thousands(record.co) &&
         count_times(layout.names.front(), record.time_s).question.empty();
}

}  // namespace

Imported import_record(const fs::path& path, const std::string& loop, const ImportOptions& options,
                       const ImportProgress& progress) {
  // The fixed format with relative times is read without the importer, and its errors are reported
  // as they are.
  std::optional<RecordError> fixed_error;
  std::error_code problem;
  const std::uintmax_t size = fs::file_size(path, problem);
  if (path != "-" && loop.empty() && !options.anything_said() && !problem &&
      size <= kLargestFixedBytes && !is_container(path)) {
    try {
      Imported out{read_record(path), {}};
      const double first_s = out.record.time_s.front();
      constexpr double kEpoch = 1e8;
      if (first_s < kEpoch && is_plain(path, out.record)) {
        out.notes.tag = file_tag(path);
        out.notes.files = path.string();
        out.notes.period_s = out.record.period_s;
        recognise_archive(out, options);
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
      for (const FileProblem& other : importer.problems())
        out.notes.remarks.push_back("left out: " + other.why);
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
      // Accepts FIC-40B for FIC-40B/PID1, if no other loop is below that name.
      std::vector<std::size_t> below;
      for (const std::size_t k : usable) {
        if (has_part(importer.loops()[k].tag, loop)) below.push_back(k);
      }
      if (below.size() == 1) return read(below.front());
      fail(fmt::format("no loop {}; it has {}", base::in_quotes(loop), list_of(importer.loops())));
    }
    if (importer.files() == 0 && !importer.problems().empty()) {
      const FileProblem& first = importer.problems().front();
      throw RecordError(first.kind, 0, 0, first.why);
    }
    if (importer.files() == 0) fail("no file in it can be read\n" + importer.passed_over_text());
    if (usable.empty()) fail(importer.no_pv());
    // If only one of several loops has a CO, it is the one that can be diagnosed.
    std::vector<std::size_t> complete;
    for (const std::size_t k : usable) {
      if (importer.loops()[k].signals.has(Role::co)) complete.push_back(k);
    }
    if (complete.size() == 1) return read(complete.front());
    if (usable.size() > 1) {
      fail(fmt::format(
          "{} loops ({}). Select one with --loop TAG, or read all with 'loopwarden survey'",
          usable.size(), list_of(importer.loops())));
    }
    return read(usable.front());
  } catch (const RecordError& e) {
    // Both readers failed: the error of the one that read further is more specific.
    if (fixed_error && e.line() == 0 && fixed_error->line() > 1) throw *fixed_error;
    throw;
  }
}

}  // namespace loopwarden::record
