// SPDX-License-Identifier: Apache-2.0
#include "record/segment_format.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string_view>
#include <type_traits>

#include "base/digest/digest.hpp"

namespace loopwarden::record {
namespace {

static_assert(std::endian::native == std::endian::little,
              "segments are written as they lie in memory");

constexpr std::array<char, 8> kMagic{'L', 'W', 'S', 'E', 'G', 'M', 'N', 'T'};
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kOldVersion = 1;
constexpr double kShortestPeriod = 1e-6;  // s
constexpr double kLongestPeriod = 1e6;    // s
// The layout of RecordRow as text, so that other programs can read the rows.
constexpr std::string_view kColumns =
    "time_ns:i64 period_index:u64 sp:f64 pv:f64 co:f64 stem:f64 calculated:f32 jacket_rate:f32 "
    "jacket_rate_shadow:f32 compensator:f32 compensator_shadow:f32 mode:u8 fault:u8 pv_quality:u8 "
    "pv_reason:u8 flags:u8 jacket_form:u8 requested_mode:u8 pv_limit:u8 age_ms:f32 row:u32 "
    "crc32:u32";
constexpr std::string_view kOldColumns =
    "time_ns:i64 period_index:u64 sp:f64 pv:f64 co:f64 stem:f64 calculated:f32 jacket:f32 "
    "jacket_shadow:f32 mode:u8 fault:u8 pv_quality:u8 pv_reason:u8 flags:u8 jacket_form:u8 "
    "requested_mode:u8 reserved:u8 age_ms:f32 row:u32 crc32:u32";

struct HeaderLayout {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t row_bytes;
  std::uint64_t sequence;
  std::uint64_t run;
  double period_s;
  std::int64_t start_utc_ns;
  std::int64_t start_monotonic_ns;
  std::array<char, 64> loop;      // terminated by a zero byte
  std::array<char, 384> columns;  // same
  std::uint32_t spare;
  std::uint32_t crc;  // of all members before it
};
static_assert(sizeof(HeaderLayout) == kSegmentHeaderBytes);
static_assert(std::is_trivially_copyable_v<HeaderLayout>);
static_assert(kColumns.size() < sizeof(HeaderLayout::columns));

struct RowLayout {
  RecordRow row;
  std::uint32_t index;
  std::uint32_t crc;  // of all members before it, continued from the header's
};
static_assert(sizeof(RowLayout) == kSegmentRowBytes);

// A row of version 1.
struct OldRowLayout {
  std::int64_t time_ns;
  std::uint64_t period_index;
  double sp;
  double pv;
  double co;
  double stem;
  float calculated;
  float jacket;  // or the compensator's
  float jacket_shadow;
  control::Mode mode;
  control::Fault fault;
  base::Quality pv_quality;
  base::Reason pv_reason;
  std::uint8_t flags;
  control::JacketForm jacket_form;
  control::Mode requested_mode;
  std::uint8_t reserved;
  float age_ms;
  std::uint32_t index;
  std::uint32_t crc;
};
constexpr std::size_t kOldRowBytes = 80;
static_assert(sizeof(OldRowLayout) == kOldRowBytes);
static_assert(std::is_trivially_copyable_v<OldRowLayout>);

RecordRow row_of(const OldRowLayout& old) noexcept {
  RecordRow row{.time_ns = old.time_ns,
                .period_index = old.period_index,
                .sp = old.sp,
                .pv = old.pv,
                .co = old.co,
                .stem = old.stem,
                .calculated = old.calculated,
                .mode = old.mode,
                .fault = old.fault,
                .pv_quality = old.pv_quality,
                .pv_reason = old.pv_reason,
                .flags = old.flags,
                .jacket_form = old.jacket_form,
                .requested_mode = old.requested_mode,
                .age_ms = old.age_ms};
  if (old.jacket_form != control::JacketForm::off) {
    row.jacket_rate = old.jacket;
    row.jacket_rate_shadow = old.jacket_shadow;
    return row;
  }
  row.compensator = old.jacket;
  row.compensator_shadow = old.jacket_shadow;
  // Version 1 used one flag for both.
  if ((row.flags & kJacketActs) != 0) {
    row.flags = static_cast<std::uint8_t>((row.flags & ~kJacketActs) | kCompensatorActs);
  }
  return row;
}

template <class Layout>
std::optional<Layout> sound_row(std::span<const char> bytes, std::uint32_t index,
                                std::uint32_t header_crc) noexcept {
  Layout layout{};
  std::memcpy(&layout, bytes.data(), sizeof layout);
  if (layout.index != index) return std::nullopt;
  if (layout.crc != base::crc32(bytes.first(offsetof(Layout, crc)), header_crc))
    return std::nullopt;
  return layout;
}

// Returns whether every enumeration of a row has a value that this version knows.
bool is_known(const RecordRow& row) noexcept {
  const bool known_quality = row.pv_quality == base::Quality::bad ||
                             row.pv_quality == base::Quality::uncertain ||
                             row.pv_quality == base::Quality::good;
  return known_quality && row.mode <= control::Mode::fallback &&
         row.requested_mode <= control::Mode::fallback &&
         row.fault <= control::Fault::output_unknown &&
         row.pv_reason <= base::Reason::out_of_service &&
         row.jacket_form <= control::JacketForm::dwell && row.pv_limit <= base::Limit::high;
}

template <std::size_t N>
std::string_view text_in(const std::array<char, N>& field) {
  return {field.data(),
          static_cast<std::size_t>(std::find(field.begin(), field.end(), '\0') - field.begin())};
}

}  // namespace

EncodedHeader encode(const SegmentHeader& header) noexcept {
  HeaderLayout layout{};
  layout.magic = kMagic;
  layout.version = kVersion;
  layout.row_bytes = kSegmentRowBytes;
  layout.sequence = header.sequence;
  layout.run = header.run;
  layout.period_s = header.period_s;
  layout.start_utc_ns = header.start_utc_ns;
  layout.start_monotonic_ns = header.start_monotonic_ns;
  std::copy_n(header.loop.begin(), std::min(header.loop.size(), layout.loop.size() - 1),
              layout.loop.begin());
  std::copy(kColumns.begin(), kColumns.end(), layout.columns.begin());

  EncodedHeader encoded{};
  std::memcpy(encoded.bytes.data(), &layout, sizeof layout);
  encoded.crc = base::crc32(std::span(encoded.bytes).first(offsetof(HeaderLayout, crc)));
  std::memcpy(encoded.bytes.data() + offsetof(HeaderLayout, crc), &encoded.crc, sizeof encoded.crc);
  return encoded;
}

DecodedHeader decode_header(std::span<const char> bytes) {
  DecodedHeader decoded;
  HeaderLayout layout{};
  if (bytes.size() < sizeof layout) {
    decoded.problem = "too short for a segment";
    return decoded;
  }
  std::memcpy(&layout, bytes.data(), sizeof layout);
  const bool old = layout.version == kOldVersion;
  if (layout.magic != kMagic) {
    decoded.problem = "not a segment";
  } else if (layout.version != kVersion && layout.version != kOldVersion) {
    decoded.problem = "a segment of another version of this program";
  } else if (layout.crc != base::crc32(bytes.first(offsetof(HeaderLayout, crc)))) {
    decoded.problem = "the segment's header is damaged";
  } else if (layout.row_bytes != (old ? kOldRowBytes : kSegmentRowBytes) ||
             text_in(layout.columns) != (old ? kOldColumns : kColumns)) {
    decoded.problem = "a segment with other columns";
  } else if (!(layout.period_s >= kShortestPeriod && layout.period_s <= kLongestPeriod)) {
    decoded.problem = "the segment's period is not one of a loop";
  }
  if (decoded.problem != nullptr) return decoded;
  decoded.crc = layout.crc;
  decoded.row_bytes = layout.row_bytes;
  decoded.header = {.sequence = layout.sequence,
                    .run = layout.run,
                    .loop = std::string(text_in(layout.loop)),
                    .period_s = layout.period_s,
                    .start_utc_ns = layout.start_utc_ns,
                    .start_monotonic_ns = layout.start_monotonic_ns};
  return decoded;
}

void encode(const RecordRow& row, std::uint32_t index, std::uint32_t header_crc,
            std::span<char> bytes) noexcept {
  const RowLayout layout{row, index, 0};
  std::memcpy(bytes.data(), &layout, sizeof layout);
  const std::uint32_t crc = base::crc32(bytes.first(offsetof(RowLayout, crc)), header_crc);
  std::memcpy(bytes.data() + offsetof(RowLayout, crc), &crc, sizeof crc);
}

std::optional<RecordRow> decode_row(std::span<const char> bytes, std::uint32_t index,
                                    std::uint32_t header_crc) noexcept {
  std::optional<RecordRow> row;
  if (bytes.size() == kOldRowBytes) {
    if (const auto old = sound_row<OldRowLayout>(bytes, index, header_crc)) row = row_of(*old);
  } else if (const auto layout = sound_row<RowLayout>(bytes, index, header_crc)) {
    row = layout->row;
  }
  return row && is_known(*row) ? row : std::nullopt;
}

}  // namespace loopwarden::record
