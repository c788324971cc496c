// SPDX-License-Identifier: Apache-2.0
// Tests of PictureMaker check positions, not bytes, because another version of the library draws
// other edges.
#include <cairo.h>

#include <cmath>
#include <limits>
#include <optional>

#include "base/clock.hpp"
#include "record/segment_ring.hpp"
#include "services/notify/channels/mail_text.hpp"
#include "services/notify/channels/webhook_channel.hpp"
#include "services/notify/picture/picture_maker.hpp"
#include "tests/services/notify/notify_support.hpp"
#include "tests/support/hung_disk.hpp"
#include "tests/support/property.hpp"

namespace picture_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;
namespace property = loopwarden::tests::property;
namespace history = loopwarden::page::history;
namespace record = loopwarden::record;

namespace {

constexpr std::int64_t kMinute_ms = 60'000;
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

struct Pixel {
  int red, green, blue;
  bool operator==(const Pixel&) const = default;
};
constexpr Pixel kWhite{255, 255, 255};

// The pixels of a PNG, decoded by libpng, which did not draw it.
class Pixels {
 public:
  explicit Pixels(const std::string& png) : rest_(png) {
    surface_ = cairo_image_surface_create_from_png_stream(&Pixels::read, this);
    REQUIRE(cairo_surface_status(surface_) == CAIRO_STATUS_SUCCESS);
  }
  Pixels(const Pixels&) = delete;
  Pixels& operator=(const Pixels&) = delete;
  ~Pixels() { cairo_surface_destroy(surface_); }

  int width() const { return cairo_image_surface_get_width(surface_); }
  int height() const { return cairo_image_surface_get_height(surface_); }
  Pixel at(int x, int y) const {
    const unsigned char* p = cairo_image_surface_get_data(surface_) +
                             y * cairo_image_surface_get_stride(surface_) + 4 * x;
    return {p[2], p[1], p[0]};
  }
  // Returns the rows of the column whose pixel matches, in the upper or the lower panel.
  template <class Is>
  std::vector<int> rows(int x, int top, int bottom, Is is) const {
    std::vector<int> found;
    for (int y = top; y < bottom; ++y) {
      if (is(at(x, y))) found.push_back(y);
    }
    return found;
  }

 private:
  static cairo_status_t read(void* self, unsigned char* to, unsigned length) {
    auto& rest = static_cast<Pixels*>(self)->rest_;
    if (rest.size() < length) return CAIRO_STATUS_READ_ERROR;
    std::copy_n(rest.begin(), length, to);
    rest.remove_prefix(length);
    return CAIRO_STATUS_SUCCESS;
  }
  std::string_view rest_;
  cairo_surface_t* surface_ = nullptr;
};

// A line between two rows of pixels has three quarters of its colour on each.
bool is_black(Pixel p) { return p.red < 100 && p.green < 100 && p.blue < 100; }
bool is_blue(Pixel p) { return p.red < 100 && p.green < 160 && p.blue - p.red > 80; }
bool is_purple(Pixel p) { return p.red - p.green > 50 && p.blue - p.green > 20; }
bool is_red(Pixel p) { return p.red > 150 && p.green < 120 && p.blue < 110; }

constexpr int kUpperTop = 68;
constexpr int kUpperBottom = 207;
constexpr int kLowerTop = 240;
constexpr int kLowerBottom = 351;

// Ten minutes with one value per second. PV steps from 4 to 6 in the middle, CO is 5 and the stem
// 3.
TrendPicture stepped() {
  TrendPicture picture{.title = "FIC-101 (cooling water): Stiction",
                       .zone = find_zone("Europe/Berlin"),
                       .stretch = {kNoon - 10 * kMinute_ms, kNoon},
                       .event_ms = kNoon - kMinute_ms,
                       .pv_unit = "L/min",
                       .co_unit = "V",
                       .pv_range = {0.0, 10.0},
                       .co_range = {0.0, 10.0},
                       .curves = {}};
  for (int i = 0; i <= 600; ++i) {
    picture.curves.t_ms.push_back(picture.stretch.from_ms + 1000 * i);
    picture.curves.columns[history::kPv].push_back(i < 300 ? 4.0F : 6.0F);
    picture.curves.columns[history::kSp].push_back(kNothing);
    picture.curves.columns[history::kCo].push_back(5.0F);
    picture.curves.columns[history::kStem].push_back(3.0F);
  }
  return picture;
}

// Between the axis at the left and the frame at the right.
int x_of(double part) { return static_cast<int>(62.0 + part * (586.0 - 62.0)); }

double middle(const std::vector<int>& rows) {
  REQUIRE_FALSE(rows.empty());
  return 0.5 * (rows.front() + rows.back());
}

std::vector<int> columns_with_mark(const Pixels& pixels) {
  std::vector<int> found;
  for (int x = 63; x < 586; ++x) {
    if (pixels.rows(x, kLowerTop, kLowerBottom, is_red).size() > 30) found.push_back(x);
  }
  return found;
}

}  // namespace

TEST_CASE("a picture's lines are where the values are", "[notify][picture]") {
  const Pixels pixels(png_of(stepped()));
  CHECK(pixels.width() == 600);
  CHECK(pixels.height() == kPictureHeight);
  CHECK(pixels.at(1, 1) == kWhite);
  CHECK(pixels.at(598, 398) == kWhite);
  const double before = middle(pixels.rows(x_of(0.3), kUpperTop, kUpperBottom, is_black));
  const double after = middle(pixels.rows(x_of(0.8), kUpperTop, kUpperBottom, is_black));
  // 2 of 2.24 L/min in 142 px.
  CHECK(before - after == Approx(126.8).margin(2.0));
  // The only line between both is the step itself.
  std::size_t most = 0;
  for (int x = x_of(0.5) - 2; x <= x_of(0.5) + 2; ++x) {
    most = std::max(most, pixels.rows(x, kUpperTop, kUpperBottom, is_black).size());
  }
  CHECK(most > 100);
  CHECK(pixels.rows(x_of(0.47), kUpperTop, kUpperBottom, is_black).size() < 5);
  const double co = middle(pixels.rows(x_of(0.3), kLowerTop, kLowerBottom, is_blue));
  const double stem = middle(pixels.rows(x_of(0.3), kLowerTop, kLowerBottom, is_purple));
  CHECK(stem - co == Approx(101.8).margin(2.0));  // 2 of 2.24 V in 114 px
  CHECK(columns_with_mark(pixels) == std::vector<int>{x_of(0.9)});
}

TEST_CASE("a picture shows a gap, no mark outside, and no travel if the stem is not read back",
          "[notify][picture]") {
  TrendPicture picture = stepped();
  for (std::size_t i = 100; i < 150; ++i) picture.curves.columns[history::kPv][i] = kNothing;
  picture.curves.columns[history::kStem].assign(601, kNothing);
  picture.event_ms = kNoon + 1;
  const Pixels pixels(png_of(picture));
  CHECK(pixels.rows(x_of(0.2), kUpperTop, kUpperBottom, is_black).empty());
  CHECK_FALSE(pixels.rows(x_of(0.3), kUpperTop, kUpperBottom, is_black).empty());
  CHECK(pixels.rows(x_of(0.3), kLowerTop - 20, kLowerBottom, is_purple).empty());
  CHECK(columns_with_mark(pixels).empty());
}

TEST_CASE("without values there is no picture", "[notify][picture]") {
  TrendPicture picture = stepped();
  for (const history::Column column : {history::kPv, history::kCo}) {
    picture.curves.columns[column].assign(601, kNothing);
  }
  CHECK(png_of(picture).empty());
  picture = stepped();
  picture.curves = {};
  CHECK(png_of(picture).empty());
  picture = stepped();
  picture.stretch.to_ms = picture.stretch.from_ms;
  CHECK(png_of(picture).empty());
}

TEST_CASE("one wild value does not flatten the curve", "[notify][picture]") {
  TrendPicture picture = stepped();
  picture.curves.columns[history::kPv][50] = 3e38F;
  picture.curves.columns[history::kPv][60] = -3e38F;
  const Pixels pixels(png_of(picture));
  const double before = middle(pixels.rows(x_of(0.3), kUpperTop, kUpperBottom, is_black));
  const double after = middle(pixels.rows(x_of(0.8), kUpperTop, kUpperBottom, is_black));
  CHECK(before - after > 15.0);  // the axis has the range and a tenth on both sides
}

TEST_CASE("any numbers and texts give a picture within its bounds", "[notify][picture]") {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const auto any = [] {
    constexpr std::array kOdd{0.0F,  -0.0F,       1e-38F,   1e-45F,
                              3e38F, -3e38F,      kNothing, std::numeric_limits<float>::infinity(),
                              1e16F, 1e16F + 2e9F};
    return property::one_of(4) == 0 ? kOdd.at(property::one_of(kOdd.size()))
                                    : static_cast<float>(property::number(-10.0, 10.0));
  };
  const std::array ranges{std::array{0.0, 10.0},         std::array{10.0, 0.0},
                          std::array{0.0, 0.0},          std::array{kInfinite, -kInfinite},
                          std::array{std::nan(""), 1.0}, std::array{1e16, 1e16 + 2.0},
                          std::array{-1e308, 1e308}};
  property::for_all("a PNG of any numbers", 30, [&] {
    TrendPicture picture = stepped();
    picture.title =
        std::string("\xFF\n\0\xE2\x80\xAE", 6) + std::string(property::one_of(400), 'W');
    picture.pv_unit = picture.title;
    picture.pv_range = ranges.at(property::one_of(ranges.size()));
    picture.co_range = ranges.at(property::one_of(ranges.size()));
    for (auto& column : picture.curves.columns) {
      for (float& value : column) value = any();
    }
    picture.curves.t_ms[7] = std::numeric_limits<std::int64_t>::max();
    picture.curves.t_ms[8] = std::numeric_limits<std::int64_t>::min();
    const std::string png = png_of(picture);
    property::require(png.starts_with("\x89PNG"), "a PNG");
    property::require(png.size() < kMostPictureBytes, "small");
  });
}

TEST_CASE("pictures are drawn for certain alarms of a message", "[notify][picture]") {
  const Event came = event_of("FIC-101");
  CHECK(pictured(message_with({came})) == std::vector<std::size_t>{0});
  // One picture per loop. Cleared alarms, the daemon's alarms, tests and long lists get no picture.
  CHECK(pictured(message_with({event_of("A", Change::went), event_of("A"), event_of("A"),
                               event_of("B", Change::unacknowledged)})) ==
        std::vector<std::size_t>{1, 3});
  CHECK(pictured(message_with({event_of("")})).empty());
  CHECK(
      pictured(message_with({event_of("A"), event_of("B"), event_of("C"), event_of("D")})).size() ==
      kMostPictures);
  CHECK(pictured(message_with(std::vector<Event>(6, came))).empty());
  Message test = message_with({came});
  test.test = true;
  CHECK(pictured(test).empty());
}

TEST_CASE("a picture begins before the alarm and ends after it, or now", "[notify][picture]") {
  const Event came = event_of("F");
  const auto fast = stretch_of(came, 0.1, 1.0, kNoon + 30'000);
  CHECK(fast.from_ms == kNoon - 10 * kMinute_ms);
  CHECK(fast.to_ms == kNoon + 30'000);
  CHECK(stretch_of(came, 0.1, 1.0, kNoon + 3'600'000).to_ms == kNoon + 150'000);
  // The same number of windows of a slow loop.
  CHECK(stretch_of(came, 1.0, 1.0, kNoon).from_ms == kNoon - 2'883'000);
  CHECK(stretch_of(came, 1.0, 10.0, kNoon).from_ms == kNoon - 288'300);
  // A reminder shows the alarm's beginning and now.
  Event waits = event_of("F", Change::unacknowledged);
  waits.waits_min = 30;
  const auto long_ago = stretch_of(waits, 0.1, 1.0, kNoon);
  CHECK(long_ago.from_ms == kNoon - 40 * kMinute_ms);
  CHECK(long_ago.to_ms == kNoon);
  waits.waits_min = 7 * 24 * 60;
  CHECK(stretch_of(waits, 0.1, 1.0, kNoon).from_ms == kNoon - 24 * 60 * kMinute_ms);
  for (const double odd : {0.0, -1.0, 1e300, std::nan(""), 1e-300}) {
    for (const double speed : {1.0, 0.0, std::nan(""), -5.0}) {
      const auto any = stretch_of(came, odd, speed, kNoon);
      CHECK(any.from_ms < any.to_ms);
      CHECK(any.to_ms - any.from_ms <= 24 * 60 * kMinute_ms);
    }
  }
}

namespace {

// Ten minutes to now, of a loop whose PV steps in the middle.
void write_segment(const std::filesystem::path& folder) {
  constexpr std::uint32_t kRows = 600;
  std::filesystem::create_directories(folder);
  const auto header = record::encode(
      record::SegmentHeader{.sequence = 1,
                            .run = 1,
                            .loop = "FIC-101",
                            .period_s = 1.0,
                            .start_utc_ns = (loopwarden::base::utc_ms() - kRows * 1000) * 1'000'000,
                            .start_monotonic_ns = 0});
  std::string bytes(header.bytes.begin(), header.bytes.end());
  for (std::uint32_t i = 0; i < kRows; ++i) {
    record::RecordRow row;
    row.time_ns = i * 1'000'000'000LL;
    row.period_index = i;
    row.pv = i < kRows / 2 ? 4.0 : 6.0;
    row.sp = row.co = row.stem = 5.0;
    std::array<char, record::kSegmentRowBytes> one{};
    record::encode(row, i, header.crc, one);
    bytes.append(one.begin(), one.end());
  }
  write_file(folder / record::segment_name(1), bytes);
}

nlohmann::json loop_with(const std::filesystem::path& folder) {
  return {{"tag", "FIC-101"},        {"pv_unit", "L/min"},     {"co_unit", "V"},
          {"sample_time_s", 1.0},    {"stem", true},           {"folder", folder.string()},
          {"pv_range", {0.0, 10.0}}, {"co_range", {0.0, 10.0}}};
}

Event came_now() {
  Event event = event_of("FIC-101");
  event.utc_ms = loopwarden::base::utc_ms();
  return event;
}

bool steps(const std::string& png) {
  const Pixels pixels(png);
  std::optional<double> first;
  double last = 0.0;
  for (int x = 70; x < 580; ++x) {
    const auto rows = pixels.rows(x, kUpperTop, kUpperBottom, is_black);
    if (rows.empty()) continue;
    if (!first) first = middle(rows);
    last = middle(rows);
  }
  return first && *first - last > 100.0;
}

}  // namespace

TEST_CASE("a picture's values are the recorder's, or otherwise the daemon's newest",
          "[notify][picture]") {
  const TemporaryFolder folder;
  FakeDaemon daemon(folder / "status.sock");
  PictureMaker pictures((folder / "status.sock").string(), find_zone("UTC"));
  const Message message = message_with({event_of("A", Change::went), came_now()});
  daemon.describe(loop_with(folder / "FIC-101"));
  CHECK(pictures.of(message).empty());  // neither source has values
  write_segment(folder / "FIC-101");
  const std::vector<Picture> recorded = pictures.of(message);
  REQUIRE(recorded.size() == 1);
  CHECK(recorded[0].event == 1);
  CHECK(steps(recorded[0].png));
  CHECK(pictures.of(message_with({event_of("FIC-999")})).empty());

  daemon.describe(loop_with(folder / "none"));
  nlohmann::json trend = {{"ok", true}, {"sample_time_s", 1.0}};
  for (int i = 0; i < 500; ++i) {
    trend["period"].push_back(i + 1);
    trend["pv"].push_back(i < 250 ? 4.0 : 6.0);
    for (const char* name : {"sp", "co", "stem", "jacket", "compensator"}) {
      trend[name].push_back(5.0);
    }
    trend["mode"].push_back("AUTO");
  }
  daemon.set_trend(trend);
  const std::vector<Picture> remembered = pictures.of(message);
  REQUIRE(remembered.size() == 1);
  CHECK(steps(remembered[0].png));
  // A damaged segment loses only its own rows.
  daemon.describe(loop_with(folder / "FIC-101"));
  write_file(folder / "FIC-101" / record::segment_name(1), "no segment");
  CHECK(pictures.of(message).size() == 1);
}

TEST_CASE("a message waits neither for a hung disk nor for an absent daemon", "[notify][picture]") {
  const TemporaryFolder folder;
  const Message message = message_with({came_now()});
  PictureMaker pictures((folder / "status.sock").string(), find_zone("UTC"));
  CHECK(pictures.of(message).empty());
  FakeDaemon daemon(folder / "status.sock");
  daemon.describe(loop_with(folder / "segments"));
  write_segment(folder / "segments");
  loopwarden::tests::HungDisk disk(folder / "segments");
  CHECK(pictures.of(message).empty());
  CHECK(disk.waiting() == 1);
  CHECK(pictures.of(message).empty());  // waits for the one that hangs
  CHECK(disk.waiting() == 1);
  disk.release();
  CHECK(eventually([&] { return pictures.of(message).size() == 1; }));
}

TEST_CASE("a mail with a picture contains text and a picture, and fetches no other part",
          "[notify][mail][picture]") {
  const TemporaryFolder folder;
  Message message = message_with({event_of("10/FIC \"1\r\n")});
  message.pictures.push_back({0, png_of(stepped())});
  EmailSettings settings;
  settings.from = "box@plant.example";
  settings.to = {"a@plant.example"};
  const std::string mail = to_crlf(mail_text(message, sender(), settings));
  CHECK(mail.find("http") == std::string::npos);
  write_file(folder / "mail", mail);
  write_file(
      folder / "read.py",
      "import email, email.policy, sys\n"
      "m = email.message_from_binary_file(open(sys.argv[1], 'rb'), policy=email.policy.default)\n"
      "parts = list(m.iter_parts())\n"
      "assert not any(p.defects for p in [m] + parts)\n"
      "assert m.get_content_type() == 'multipart/mixed', m.get_content_type()\n"
      "assert [p.get_content_type() for p in parts] == ['text/plain', 'image/png']\n"
      "assert parts[1].get_content_disposition() == 'inline'\n"
      "assert parts[1].get_filename() == 'trend-10_FIC__1__.png', parts[1].get_filename()\n"
      "assert all(len(line) <= 78 for line in open(sys.argv[1]).read().split('\\n'))\n"
      "open(sys.argv[1] + '.text', 'w', newline='').write(parts[0].get_content())\n"
      "open(sys.argv[1] + '.png', 'wb').write(parts[1].get_content())\n");
  const auto read = loopwarden::tests::run("python3 " + (folder / "read.py").string() + " " +
                                           (folder / "mail").string() + " 2>&1");
  INFO(read.text);
  REQUIRE(read.exit_code == 0);
  CHECK(read_file(folder / "mail.text") == letter(message, sender()));
  CHECK(read_file(folder / "mail.png") == message.pictures[0].png);
}

TEST_CASE("a webhook's event has its picture in base64, or omits the field", "[notify][picture]") {
  Message message = message_with({event_of("A"), event_of("B")});
  const auto event = [&](std::size_t i) {
    return nlohmann::json::parse(webhook_body(message, sender())).at("events").at(i);
  };
  CHECK_FALSE(event(1).contains("picture"));
  message.pictures.push_back({1, "\x89PNG"});
  CHECK_FALSE(event(0).contains("picture"));
  CHECK(event(1).at("picture") == "iVBORw==");
}

}  // namespace picture_test
