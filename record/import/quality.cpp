// SPDX-License-Identifier: Apache-2.0
#include "record/import/quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "base/text.hpp"
#include "record/import/number_text.hpp"

namespace loopwarden::record {
namespace {

constexpr std::size_t kMostStates = 60000;

// Letters with accents and their plain forms: both cases of Latin-1, and some of Latin Extended-A.
constexpr std::array<std::pair<std::string_view, std::string_view>, 53> kPlainLetters{
    {{"\u00e4", "a"}, {"\u00c4", "a"},  {"\u00f6", "o"}, {"\u00d6", "o"}, {"\u00fc", "u"},
     {"\u00dc", "u"}, {"\u00df", "ss"}, {"\u00e9", "e"}, {"\u00c9", "e"}, {"\u00e8", "e"},
     {"\u00ea", "e"}, {"\u00e0", "a"},  {"\u00e1", "a"}, {"\u00c1", "a"}, {"\u00e2", "a"},
     {"\u00e3", "a"}, {"\u00e7", "c"},  {"\u00ed", "i"}, {"\u00ee", "i"}, {"\u00f3", "o"},
     {"\u00d3", "o"}, {"\u00f4", "o"},  {"\u00f5", "o"}, {"\u00fa", "u"}, {"\u00f1", "n"},
     {"\u00e5", "a"}, {"\u00c5", "a"},  {"\u00f8", "o"}, {"\u00d8", "o"}, {"\u00e6", "ae"},
     {"\u0161", "s"}, {"\u0160", "s"},  {"\u0159", "r"}, {"\u011b", "e"}, {"\u010d", "c"},
     {"\u017e", "z"}, {"\u0142", "l"},  {"\u0119", "e"}, {"\u0105", "a"}, {"\u015b", "s"},
     {"\u015a", "s"}, {"\u0107", "c"},  {"\u0144", "n"}, {"\u017a", "z"}, {"\u017c", "z"},
     {"\u00fd", "y"}, {"\u016f", "u"},  {"\u0151", "o"}, {"\u011f", "g"}, {"\u015f", "s"},
     {"\u0131", "i"}, {"\u0130", "i"},  {"\u0103", "a"}}};

// Returns the text in lower case without accents, also for Cyrillic letters.
std::string folded(std::string_view text) {
  std::string word = base::lower_case(text);
  for (std::size_t k = 0; k + 1 < word.size(); ++k) {
    if (static_cast<unsigned char>(word[k]) < 0xC0) continue;
    for (const auto& [from, to] : kPlainLetters) {
      if (std::string_view(word).substr(k).starts_with(from)) {
        word.replace(k, from.size(), to);
        break;
      }
    }
    const auto second = static_cast<unsigned char>(word[k + 1 < word.size() ? k + 1 : k]);
    if (static_cast<unsigned char>(word[k]) != 0xD0 || second < 0x90 || second > 0xAF) continue;
    if (second < 0xA0) {
      word[k + 1] = static_cast<char>(second + 0x20);
    } else {
      word[k] = static_cast<char>(0xD1);
      word[k + 1] = static_cast<char>(second - 0x20);
    }
  }
  return word;
}

std::string as_key(std::string_view text) {
  std::string word;
  for (const char c : folded(text)) {
    if (std::string_view(" _-./:()[]?").find(c) == std::string_view::npos) word += c;
  }
  return word;
}

// `list`: words between blanks.
bool has_word(std::string_view list, const std::string& word) {
  return !word.empty() && word.find(' ') == word.npos && list.find(' ' + word + ' ') != list.npos;
}

// Returns whether a word of the list is `text` or its beginning. Words of up to three letters must
// match completely.
bool begins_with_one_of(std::string_view list, std::string_view text) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find('|'), list.size());
    const std::string_view word = list.substr(0, end);
    list.remove_prefix(std::min(end + 1, list.size()));
    const bool is_short = word.size() <= 3 && static_cast<unsigned char>(word.front()) < 0x80;
    const bool ends = text.size() == word.size() ||
                      (text.size() > word.size() &&
                       !((text[word.size()] | 0x20) >= 'a' && (text[word.size()] | 0x20) <= 'z'));
    if (text.starts_with(word) && (!is_short || ends)) return true;
  }
  return false;
}

constexpr std::string_view kGoodPhrases =
    "no error|no alarm|no fault|noerror|noalarm|nofault|kein fehler|sin error|sin fallo|"
    "pas de defaut|nessun errore|\u65e0\u6545\u969c|\u65e0\u9519\u8bef";
constexpr std::string_view kDoubtStates =
    "uncertain|question|doubt|suspect|substitut|estimated|simulated|initial|last usable|"
    "unsicher|fraglich|zweifelhaft|ersatz|incertain|douteu|inciert|dudos|incert|dubbi|duvidos|"
    "onzeker|twijfel|osaker|usikker|niepewn|watpliw|nejist|u|q|"
    "\u4e0d\u786e\u5b9a|\u53ef\u7591|\u4e0d\u78ba\u5b9a|\u4e0d\u78ba\u304b|\ubd88\ud655\uc2e4|"
    "\u043d\u0435\u043e\u043f\u0440\u0435\u0434|\u0441\u043e\u043c\u043d\u0438\u0442";
constexpr std::string_view kBadStates =
    "bad|invalid|not |non |non-|nicht |notgood|no good|no data|no comm|no sample|no value|nodata|"
    "fail|fault|error|err|nok|unreliable|unusable|disconnect|offline|timeout|time out|i/o|io time|"
    "scan off|out of serv|outofserv|stale|shutdown|comm|config|device|over range|under range|"
    "overrange|underrange|missing|lost|b|false|unknown|wire break|wirebreak|broken|drahtbruch|"
    "huono|kotu|rossz|schlecht|ungultig|ungueltig|gestort|gestoert|storung|stoerung|defekt|fehler|"
    "ausfall|"
    "mauvais|invalide|erreur|defaut|panne|hors |malo|mala|invalid|erron|fallo|falla|averia|no "
    "valid|"
    "cattiv|guast|errat|errore|scadente|ruim|mau|ma|falha|erro|slecht|ongeldig|fout|storing|dalig|"
    "darlig|ogiltig|ugyldig|feil|fejl|fel|zly|zla|zle|bledn|blad|niewazn|spatn|neplatn|chyb|"
    "\u574f|\u5dee|\u4e0d\u826f|\u5f02\u5e38|\u7570\u5e38|\u65e0\u6548|\u7121\u52b9|\u7121\u6548|"
    "\u6545\u969c|\u9519\u8bef|\u5931\u8d25|\u574f\u503c|\ubd88\ub7c9|\uc624\ub958|\uc774\uc0c1|"
    "\u043f\u043b\u043e\u0445|\u043d\u0435\u0434\u043e\u0441\u0442|\u043e\u0448\u0438\u0431|"
    "\u043d\u0435\u0438\u0441\u043f\u0440|\u043e\u0442\u043a\u0430\u0437|\u0430\u0432\u0430\u0440";
// Words for bad or doubtful values that have no other use.
constexpr std::string_view kOnlyOfValues =
    "bad|invalid|no data|uncertain|questionable|schlecht|ungultig|ungueltig|mauvais|invalide";
constexpr std::string_view kGoodStates =
    "good|ok|okay|true|valid|normal|reliable|g|y|yes|a|gut|gultig|gueltig|ja|bon|bonne|valide|"
    "correct|"
    "oui|buena|bueno|buen|valido|valida|correcto|si|buono|buona|bom|boa|sim|goed|geldig|bra|giltig|"
    "gyldig|god|godt|hyva|iyi|jo|dobr|prawidl|poprawn|wazn|platn|raw|actual|interpolated|"
    "calculated|"
    "\u597d|\u826f\u597d|\u826f|\u6b63\u5e38|\u6709\u6548|\u6709\u52b9|\u512a|\u662f|\uc591\ud638|"
    "\uc815\uc0c1|\u0445\u043e\u0440\u043e\u0448|\u043d\u043e\u0440\u043c|"
    "\u0434\u043e\u0441\u0442\u043e\u0432|\u0433\u043e\u0434\u043d|\u0438\u0441\u043f\u0440";

constexpr std::string_view kStates =
    " quality qf dataintegrity qualitatscode qualitaetscode opcquality qualitydetail "
    "opcqualitydetail qualitystatus qualitycode qualityflag"
    " qualitystate qualitybits qcode qflag qstatus qlevel q qc qual qlty opcstatus statuscode"
    " statusvalue valuestatus valuequality valuequalitycode dataquality datastatus samplequality"
    " samplestatus signalquality signalstatus sigstatus tagstatus tagquality pointquality "
    "measquality"
    " measurementquality vqtquality iptrendqstatus iptrendqlevel ipvaluequality ipinputquality"
    " ipvaluestatus uastatus uastatuscode"
    " qualite qualitat qualitaet calidad qualita qualidade laatu kalite minoseg calitate kwaliteit "
    "kvalitet jakosc kvalita"
    " gute guete \u8d28\u91cf \u54c1\u8d28 \u54c1\u8cea \u8cea\u91cf \u8d28\u91cf\u7801"
    " \u6570\u636e\u8d28\u91cf \ud488\uc9c8 \u043a\u0430\u0447\u0435\u0441\u0442\u0432\u043e ";
constexpr std::string_view kStatuses =
    " status statusbits sts stat state statut zustand estado estatus etat stato stav messstatus"
    " \u72b6\u6001 \u72c0\u614b \uc0c1\ud0dc \u0441\u0442\u0430\u0442\u0443\u0441 ";
constexpr std::string_view kGoodFlags =
    " qualityok qualitygood qualityvalid goodquality good isgood valid isvalid validity "
    "validityflag ok isok reliable trusted gultig gultigkeit"
    " gueltig gueltigkeit validite valide validez valido valida validita geldig giltig"
    " \u6709\u6548 \u6709\u6548\u6027 ";
constexpr std::string_view kBadFlags =
    " sensorfault sensorerror commfault commerror qualitybad bad isbad badflag invalid isinvalid "
    "badquality fault faulty iserror stale isstale ungultig"
    " ungueltig invalide invalido \u65e0\u6548 ";
constexpr std::string_view kDoubtFlags =
    " questionable isquestionable questionableflag questionflag substituted issubstituted suspect"
    " uncertain isuncertain doubtful ";
constexpr std::string_view kPercents =
    " confidence conf percentgood pctgood goodpercent percentquality qualitypercent ";

}  // namespace

QualityKind quality_kind(std::string_view column_name) {
  // Removes type letters of IEC 61131: bValid, xGood, wStatus.
  if (column_name.size() > 2 &&
      std::string_view("bxwsin").find(column_name[0]) != std::string_view::npos &&
      column_name[1] >= 'A' && column_name[1] <= 'Z')
    column_name.remove_prefix(1);
  const std::string word = as_key(column_name);
  if (word == "iquality") return QualityKind::industrial_pc;
  for (const auto& [list, kind] :
       {std::pair{kStates, QualityKind::state},
        {kStatuses, QualityKind::status},
        {std::string_view(" flags flag statusflags qualityflags "), QualityKind::flags},
        {kGoodFlags, QualityKind::good_flag},
        {kBadFlags, QualityKind::bad_flag},
        {kDoubtFlags, QualityKind::doubt_flag},
        {kPercents, QualityKind::percent}}) {
    if (has_word(list, word)) return kind;
  }
  return QualityKind::none;
}

std::optional<SampleQuality> quality_of_word(std::string_view text) {
  std::string word = folded(base::trimmed(text));
  while (!word.empty() && std::string_view("([{<'\"").find(word.front()) != std::string_view::npos)
    word.erase(0, 1);
  if (begins_with_one_of(kGoodPhrases, word)) return SampleQuality::good;
  if (begins_with_one_of(kDoubtStates, word)) return SampleQuality::questionable;
  if (begins_with_one_of(kBadStates, word)) return SampleQuality::bad;
  if (!begins_with_one_of(kGoodStates, word)) return std::nullopt;
  // In "validation failed" or "good (substituted)" the worse of the later words decides.
  for (std::size_t at = word.find_first_of(" _,("); at != word.npos;
       at = word.find_first_of(" _,(", at + 1)) {
    const std::string_view rest = std::string_view(word).substr(at + 1);
    if (rest.size() < 3) continue;
    if (begins_with_one_of("fail|fault|error|bad|invalid", rest)) return SampleQuality::bad;
    if (begins_with_one_of("uncertain|question|substitut|doubt", rest))
      return SampleQuality::questionable;
  }
  return SampleQuality::good;
}

bool says_good(std::string_view word) {
  return quality_of_word(word) == SampleQuality::good &&
         begins_with_one_of(
             "good|ok|gut|bon|bonne|buen|buon|boa|goed|dobr|hyva|valid|gultig|gyldig|giltig|"
             "\u597d|\u826f|\uc591\ud638|\u0445\u043e\u0440\u043e\u0448",
             folded(base::trimmed(word)));
}

QualityCells::Id QualityCells::add(std::string_view cell) {
  if (last_ < states_.size() && states_[last_].text == cell) {
    ++states_[last_].cells;
    return last_;
  }
  const auto [at, is_new] = ids_.try_emplace(std::string(cell), static_cast<Id>(states_.size()));
  if (is_new && states_.size() >= kMostStates) {  // treated as the last state if there are too many
    at->second = static_cast<Id>(states_.size() - 1);
  } else if (is_new) {
    State state;
    state.text = cell;
    const std::size_t digits = cell.find_first_of("0123456789");
    const bool hexadecimal = cell.starts_with("0x") || cell.starts_with("0X");
    std::uint64_t bits = 0;
    if (hexadecimal) {
      const auto [end, problem] =
          std::from_chars(cell.data() + 2, cell.data() + cell.size(), bits, 16);
      if (problem == std::errc{}) state.code = static_cast<std::int64_t>(bits & 0xFFFFFFFFU);
      state.hexadecimal = state.code && end - cell.data() > 6;
    } else if (const auto number = parse_number(cell, cell.find(',') == cell.npos ? '.' : ',');
               number && digits != cell.npos && *number > -3e9 && *number < 5e9) {
      state.code = static_cast<std::int64_t>(*number);
      state.fraction = *number != std::nearbyint(*number);
    }
    states_.push_back(std::move(state));
  }
  last_ = at->second;
  ++states_[last_].cells;
  return last_;
}

// Returns the quality of true and false, written as words or as 1 and 0.
SampleQuality QualityCells::by_name(bool flag) const {
  if (kind_ == QualityKind::bad_flag) return flag ? SampleQuality::bad : SampleQuality::good;
  if (kind_ == QualityKind::doubt_flag)
    return flag ? SampleQuality::questionable : SampleQuality::good;
  return flag ? SampleQuality::good : SampleQuality::bad;
}

void QualityCells::settle_words() {
  const bool flags = kind_ == QualityKind::good_flag || kind_ == QualityKind::bad_flag ||
                     kind_ == QualityKind::doubt_flag;
  for (State& state : states_) {
    if (state.text.empty()) state.known = true;
    if (state.text.empty() || state.code) continue;
    const std::string word = folded(state.text);
    if (flags && (has_word(" true yes t y ja oui si sim wahr vrai verdadero x \u662f ", word) ||
                  has_word(" false no f n nein non falsch faux falso \u5426 ", word))) {
      state.known = true;
      state.quality =
          by_name(has_word(" true yes t y ja oui si sim wahr vrai verdadero x \u662f ", word));
      continue;
    }
    std::string_view text(state.text);
    auto quality = quality_of_word(text);
    // "192 - Good", "0x00000000 (Good)"
    if (!quality && (text.front() >= '0' && text.front() <= '9')) {
      const std::size_t letters = text.find_first_not_of("0123456789xXabcdefABCDEF ([-:");
      std::size_t from = text.find_first_of(" ([-:");
      if (from != text.npos) from = text.find_first_not_of(" ([-:", from);
      if (from != text.npos && letters != text.npos) quality = quality_of_word(text.substr(from));
    }
    if (!quality) continue;
    state.known = true;
    state.quality = *quality;
  }
}

void QualityCells::settle_flags() {
  std::size_t zeros = 0;
  std::size_t ones = 0;
  for (const State& state : states_) {
    if (!state.code) continue;
    (*state.code == 0 ? zeros : ones) += state.cells;
  }
  const bool named = kind_ == QualityKind::good_flag || kind_ == QualityKind::bad_flag ||
                     kind_ == QualityKind::doubt_flag;
  more_frequent_taken_ = !named && zeros > 0 && ones > 0;
  for (State& state : states_) {
    if (!state.code) continue;
    const bool one = *state.code != 0;
    state.known = true;
    if (named) {
      state.quality = by_name(one);
    } else if (more_frequent_taken_) {
      state.quality = one == (ones > zeros) ? SampleQuality::good : SampleQuality::bad;
    }
  }
}

void QualityCells::settle_codes() {
  std::int64_t least = 0;
  std::int64_t most = 0;
  std::size_t frequent = 0;
  std::int64_t frequent_code = 0;
  bool any = false;
  bool hexadecimal = false;
  const auto has = [this](std::int64_t code) {
    return std::any_of(states_.begin(), states_.end(),
                       [code](const State& state) { return state.code == code; });
  };
  for (const State& state : states_) {
    if (!state.code) continue;
    any = true;
    least = std::min(least, *state.code);
    most = std::max(most, *state.code);
    hexadecimal = hexadecimal || state.hexadecimal;
    if (state.cells > frequent) {
      frequent = state.cells;
      frequent_code = *state.code;
    }
  }
  if (!any) return;
  const bool percent = kind_ == QualityKind::percent || (most == 100 && least == 0 && has(100));
  const bool ua = hexadecimal || most >= 0x40000000 || least < -1;
  const bool ewon = kind_ == QualityKind::industrial_pc || (frequent_code == 3 && !has(192));
  const bool aveva = has(133) && !has(192);
  if (!percent && !ua && !ewon && most <= 1) {
    settle_flags();
    return;
  }
  for (State& state : states_) {
    if (!state.code) continue;
    const auto code = static_cast<std::uint64_t>(*state.code) & 0xFFFFFFFFU;
    const auto low = code & 0xC0U;
    state.known = true;
    if (kind_ == QualityKind::flags) continue;  // bits without a known meaning: not used
    if (percent) {
      const bool whole = most > 1;
      state.quality = *state.code >= (whole ? 100 : 1) ? SampleQuality::good
                      : *state.code > 0                ? SampleQuality::questionable
                                                       : SampleQuality::bad;
    } else if (ua) {
      const auto top = code >> 30U;
      // A column of status codes may also contain the 192 of an older source.
      state.quality = top == 0   ? SampleQuality::good
                      : top == 1 ? SampleQuality::questionable
                                 : SampleQuality::bad;
    } else if (ewon) {
      state.quality = code == 3 ? SampleQuality::good : SampleQuality::bad;
    } else if (aveva) {
      state.quality = code == 0     ? SampleQuality::good
                      : code == 133 ? SampleQuality::questionable
                                    : SampleQuality::bad;
    } else if ((low == 0xC0U && (code < 256 || code >= 512)) || (low == 0x80U && code < 256) ||
               code == 1) {
      state.quality = SampleQuality::good;
    } else if (low == 0x40U || (code >= 256 && code < 512)) {
      state.quality = SampleQuality::questionable;
    } else {
      state.quality = SampleQuality::bad;
      state.known = code < 32 && code % 4 == 0;  // of OPC DA
    }
  }
}

// Returns whether the column has another meaning: a product's quality, the state of a pump, unknown
// bits.
bool QualityCells::has_other_meaning() const {
  constexpr double kNearlyAll = 0.9;  // of the cells: the usual state of a value is good
  const bool vague = kind_ == QualityKind::status || kind_ == QualityKind::flags;
  bool known_state = false;
  bool unknown = false;
  bool fractions = false;
  bool binary = true;
  const State* usual = nullptr;
  std::size_t all = 0;
  for (const State& state : states_) {
    const std::int64_t code = state.code.value_or(0);
    const bool scheme = state.hexadecimal || code == 192 || code >= 0x40000000 || code < -1;
    const bool good_word = state.known && state.quality == SampleQuality::good &&
                           !state.text.empty() && (!vague || says_good(state.text));
    const bool bad_word = begins_with_one_of(kOnlyOfValues, folded(state.text));
    known_state = known_state || good_word || bad_word || (scheme && kind_ != QualityKind::flags);
    unknown = unknown || !state.known;
    fractions = fractions || state.fraction;
    binary = binary && code >= 0 && code <= 1;
    all += state.cells;
    if (usual == nullptr || state.cells > usual->cells) usual = &state;
  }
  if (known_state) return false;
  if (fractions) return kind_ != QualityKind::percent;
  if (!vague || !unknown) return false;
  const bool may_be_good = !usual->code || binary || (*usual->code & 0x80) != 0;  // of OPC DA
  return kind_ == QualityKind::flags || !may_be_good ||
         static_cast<double>(usual->cells) < kNearlyAll * static_cast<double>(all);
}

std::string QualityCells::most_frequent() const {
  const auto most =
      std::max_element(states_.begin(), states_.end(),
                       [](const State& a, const State& b) { return a.cells < b.cells; });
  return most == states_.end() ? std::string() : most->text;
}

std::vector<std::string> QualityCells::settle() {
  settle_words();
  if (has_other_meaning()) {
    constexpr std::size_t kMostListed = 3;
    std::string list;
    for (std::size_t k = 0; k < states_.size(); ++k) {
      State& state = states_[k];
      state.quality = SampleQuality::good;
      if (k < kMostListed)
        list += fmt::format("{}{} in {} {}", k > 0 ? ", " : "", base::in_quotes(state.text),
                            state.cells, state.cells == 1 ? "cell" : "cells");
    }
    if (states_.size() > kMostListed) list += ", ...";
    return {"not used, because it has no state that is known as a good quality: " + list};
  }
  settle_codes();
  std::vector<std::string> said;
  std::size_t all = 0;
  bool any_good = false;
  State* frequent = nullptr;
  for (State& state : states_) {
    all += state.cells;
    any_good =
        any_good || (state.known && state.quality == SampleQuality::good && !state.text.empty());
    if (!state.known && (frequent == nullptr || state.cells > frequent->cells)) frequent = &state;
  }
  constexpr std::size_t kMostSaid = 8;
  for (State& state : states_) {
    if (state.known) continue;
    const bool good = &state == frequent && !any_good && 2 * state.cells > all;
    state.quality = good ? SampleQuality::good : SampleQuality::bad;
    if (said.size() == kMostSaid) continue;
    said.push_back(fmt::format("{} in {} {}: not known, taken as {}", base::in_quotes(state.text),
                               state.cells, state.cells == 1 ? "cell" : "cells",
                               good ? "good because most cells have it" : "bad"));
  }
  if (more_frequent_taken_) {
    for (const State& state : states_) {
      if (state.code && state.quality == SampleQuality::good) {
        said.push_back(fmt::format("{} in {} cells: taken as good because most cells have it",
                                   base::in_quotes(state.text), state.cells));
        break;
      }
    }
  }
  return said;
}

}  // namespace loopwarden::record
