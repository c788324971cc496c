// SPDX-License-Identifier: Apache-2.0
#include "services/notify/picture/trend_picture.hpp"

#include <cairo.h>
#include <date/tz.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "base/text.hpp"
#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

using page::history::Column;

struct Colour {
  double red, green, blue;
};
// The page's colours, in its light theme.
constexpr Colour kPaper{1.0, 1.0, 1.0};
constexpr Colour kGrid{0.87, 0.89, 0.91};
constexpr Colour kFrame{0.60, 0.64, 0.68};
constexpr Colour kInk{0.08, 0.09, 0.11};
constexpr Colour kSoft{0.35, 0.39, 0.43};
constexpr Colour kEvent{0.75, 0.22, 0.17};
constexpr Colour kSetPoint{0.42, 0.45, 0.49};
constexpr Colour kOutput{0.0, 0.38, 0.60};
constexpr Colour kTravel{0.64, 0.25, 0.48};

constexpr double kLeft = 62.0;  // px
constexpr double kRight = kPictureWidth - 14.0;
constexpr double kSmall = 11.0;
constexpr double kLarge = 15.0;
constexpr double kMark = 48.0;  // position of the alarm's time, above the panels

struct Box {
  double top, bottom;
};
constexpr Box kUpper{66.0, 208.0};
constexpr Box kLower{238.0, 352.0};

struct Line {
  const char* name;
  Column column;
  Colour colour;
  bool dashed;
};

struct Panel {
  Box box;
  std::string unit;
  std::array<double, 2> range;
  std::vector<Line> lines;  // the last is drawn on top
};

struct Axis {
  double low, high, step;
  double at(double value, const Box& box) const {
    return box.bottom - (value - low) / (high - low) * (box.bottom - box.top);
  }
};

class Canvas {
 public:
  Canvas()
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, kPictureWidth, kPictureHeight)),
        cairo_(cairo_create(surface_.get())) {
    colour(kPaper);
    cairo_paint(get());
  }
  cairo_t* get() const { return cairo_.get(); }
  void colour(Colour c) { cairo_set_source_rgb(get(), c.red, c.green, c.blue); }
  void font(double size, bool bold = false) {
    cairo_select_font_face(get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(get(), size);
  }
  double width(const std::string& text) {
    cairo_text_extents_t extents;
    cairo_text_extents(get(), text.c_str(), &extents);
    return extents.x_advance;
  }
  // `part`: share of the text's width left of x; 0, 0.5 or 1.
  void text(const std::string& text, double x, double y, double part = 0.0) {
    cairo_move_to(get(), x - part * width(text), y);
    cairo_show_text(get(), text.c_str());
  }
  // Draws as much of the text as fits into `room`.
  void text_within(const std::string& whole, double x, double y, double room) {
    std::string shown = whole;
    for (std::size_t bytes = whole.size(); bytes > 0 && width(shown) > room; --bytes) {
      shown = std::string(base::cut(whole, bytes - 1)) + "...";
    }
    text(shown, x, y);
  }
  // Centres a hairline on pixels, not between them.
  void hair(double x0, double y0, double x1, double y1) {
    cairo_set_line_width(get(), 1.0);
    cairo_move_to(get(), std::floor(x0) + 0.5, std::floor(y0) + 0.5);
    cairo_line_to(get(), std::floor(x1) + 0.5, std::floor(y1) + 0.5);
    cairo_stroke(get());
  }
  void dash(bool on, double length = 5.0) { cairo_set_dash(get(), &length, on ? 1 : 0, 0.0); }
  std::string png() const {
    std::string bytes;
    const auto append = [](void* to, const unsigned char* data, unsigned length) {
      static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), length);
      return CAIRO_STATUS_SUCCESS;
    };
    const bool sound =
        cairo_status(get()) == CAIRO_STATUS_SUCCESS &&
        cairo_surface_write_to_png_stream(surface_.get(), append, &bytes) == CAIRO_STATUS_SUCCESS;
    return sound ? bytes : std::string();
  }

 private:
  struct Free {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
  };
  std::unique_ptr<cairo_surface_t, Free> surface_;
  std::unique_ptr<cairo_t, Free> cairo_;
};

const std::vector<float>& values_of(const TrendPicture& picture, Column column) {
  return picture.curves.columns[column];
}

bool is_there(const TrendPicture& picture, Column column) {
  const std::vector<float>& values = values_of(picture, column);
  return std::any_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

// Returns 1, 2 or 5 times a power of ten, about 1/`parts` of the span.
double round_step(double span, double parts) {
  const double power = std::pow(10.0, std::floor(std::log10(span / parts)));
  for (const double times : {1.0, 2.0, 5.0}) {
    if (span <= times * power * parts) return times * power;
  }
  return 10.0 * power;
}

// Returns the range of the panel's lines: at least a twentieth of the loop's range, and not far
// beyond it. So noise does not look like a swing, and a wrong value does not flatten all others.
Axis axis_of(const Panel& panel, const TrendPicture& picture) {
  constexpr double kLeast = 0.05;
  constexpr double kBeyond = 0.1;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Line& line : panel.lines) {
    for (const float value : values_of(picture, line.column)) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, static_cast<double>(value));
      high = std::max(high, static_cast<double>(value));
    }
  }
  const double span = panel.range[1] - panel.range[0];
  double least = 0.0;
  if (std::isfinite(span) && span > 0.0) {
    const double lowest = panel.range[0] - kBeyond * span;
    const double highest = panel.range[1] + kBeyond * span;
    low = std::clamp(low, lowest, highest);
    high = std::clamp(high, lowest, highest);
    least = kLeast * span;
  }
  least = std::max(least, 1e-9 * std::max(1.0, std::abs(low)));
  const double missing = std::max(0.0, least - (high - low));
  const double margin = missing / 2.0 + 0.06 * (high - low + missing);
  return {low - margin, high + margin, round_step(high - low + 2.0 * margin, 5.0)};
}

struct TimeAxis {
  double from_ms, to_ms;
  double at(std::int64_t utc_ms) const {
    return kLeft + (static_cast<double>(utc_ms) - from_ms) / (to_ms - from_ms) * (kRight - kLeft);
  }
};

date::sys_time<std::chrono::milliseconds> moment_of(std::int64_t utc_ms) {
  return date::sys_time<std::chrono::milliseconds>{std::chrono::milliseconds(utc_ms)};
}

std::string clock_text(std::int64_t utc_ms, const date::time_zone& zone, const char* format) {
  return date::format(
      format, date::make_zoned(&zone, date::floor<std::chrono::seconds>(moment_of(utc_ms))));
}

// Returns a step of whole seconds, minutes or hours of the local clock.
std::int64_t time_step_ms(std::int64_t span_ms) {
  constexpr std::int64_t kMostTicks = 7;
  for (const std::int64_t step_s :
       {1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200}) {
    if (span_ms <= kMostTicks * step_s * 1000) return step_s * 1000;
  }
  constexpr std::int64_t kDay = 86'400'000;  // ms
  return kDay * (1 + span_ms / (kMostTicks * kDay));
}

void draw_times(Canvas& canvas, const TrendPicture& picture, const TimeAxis& time) {
  const auto [from_ms, to_ms] = picture.stretch;
  const std::int64_t step_ms = time_step_ms(to_ms - from_ms);
  const std::int64_t offset_ms =
      std::chrono::milliseconds(picture.zone->get_info(moment_of(from_ms)).offset).count();
  const char* format = step_ms % 60'000 != 0 ? "%T" : "%H:%M";
  canvas.font(kSmall);
  for (std::int64_t at_ms = ((from_ms + offset_ms) / step_ms + 1) * step_ms - offset_ms;
       at_ms < to_ms; at_ms += step_ms) {
    const double x = time.at(at_ms);
    canvas.colour(kGrid);
    canvas.hair(x, kUpper.top, x, kUpper.bottom);
    canvas.hair(x, kLower.top, x, kLower.bottom);
    canvas.colour(kSoft);
    canvas.text(clock_text(at_ms, *picture.zone, format), x, kLower.bottom + 16.0, 0.5);
  }
  canvas.colour(kSoft);
  canvas.text(clock_text(picture.event_ms, *picture.zone, "%F, local time (UTC%Ez)"),
              (kLeft + kRight) / 2.0, kLower.bottom + 34.0, 0.5);
}

void draw_levels(Canvas& canvas, const Panel& panel, const Axis& axis) {
  canvas.font(kSmall);
  constexpr int kMostLevels = 12;
  const double first = std::ceil(axis.low / axis.step) * axis.step;
  for (int i = 0; i < kMostLevels; ++i) {
    const double level = first + i * axis.step;
    if (!(level <= axis.high)) break;
    const double y = axis.at(level, panel.box);
    canvas.colour(kGrid);
    canvas.hair(kLeft, y, kRight, y);
    canvas.colour(kSoft);
    canvas.text(fmt::format("{:.6g}", std::abs(level) < 1e-6 * axis.step ? 0.0 : level),
                kLeft - 6.0, y + 4.0, 1.0);
  }
}

// A value that is not a number interrupts the line. Values far outside are cut: cairo counts in
// 1/256 px of 32 bits.
void draw_line(Canvas& canvas, const TrendPicture& picture, const Line& line, const Box& box,
               const Axis& axis, const TimeAxis& time) {
  constexpr double kFar = 1000.0;  // px
  const std::vector<float>& values = values_of(picture, line.column);
  cairo_save(canvas.get());
  cairo_rectangle(canvas.get(), kLeft, box.top, kRight - kLeft, box.bottom - box.top);
  cairo_clip(canvas.get());
  canvas.colour(line.colour);
  cairo_set_line_width(canvas.get(), 1.5);
  cairo_set_line_join(canvas.get(), CAIRO_LINE_JOIN_ROUND);
  canvas.dash(line.dashed);
  bool drawing = false;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      drawing = false;
      continue;
    }
    const double x = std::clamp(time.at(picture.curves.t_ms[i]), -kFar, kFar);
    const double y = std::clamp(axis.at(static_cast<double>(values[i]), box), -kFar, kFar);
    drawing ? cairo_line_to(canvas.get(), x, y) : cairo_move_to(canvas.get(), x, y);
    drawing = true;
  }
  cairo_stroke(canvas.get());
  cairo_restore(canvas.get());
}

// Draws the legend above the panel, after its unit.
void draw_legend(Canvas& canvas, const Panel& panel) {
  constexpr double kSwatch = 20.0;     // px
  constexpr double kMostUnit = 150.0;  // px
  const double y = panel.box.top - 6.0;
  const std::string unit = one_line(panel.unit);
  canvas.font(kSmall);
  canvas.colour(kSoft);
  canvas.text_within(unit, kLeft, y, kMostUnit);
  double x = kLeft + (unit.empty() ? 0.0 : std::min(canvas.width(unit), kMostUnit) + 18.0);
  // Names the line on top first.
  for (auto line = panel.lines.rbegin(); line != panel.lines.rend(); ++line) {
    canvas.colour(line->colour);
    cairo_set_line_width(canvas.get(), 2.0);
    canvas.dash(line->dashed, 4.0);
    cairo_move_to(canvas.get(), x, y - 4.0);
    cairo_line_to(canvas.get(), x + kSwatch, y - 4.0);
    cairo_stroke(canvas.get());
    canvas.dash(false);
    canvas.colour(kInk);
    canvas.text(line->name, x + kSwatch + 5.0, y);
    x += kSwatch + canvas.width(line->name) + 21.0;
  }
}

void draw_panel(Canvas& canvas, const TrendPicture& picture, Panel panel, const TimeAxis& time) {
  std::erase_if(panel.lines, [&](const Line& line) { return !is_there(picture, line.column); });
  canvas.colour(kFrame);
  const Box& box = panel.box;
  if (panel.lines.empty()) {
    canvas.font(kSmall);
    canvas.text("no values", (kLeft + kRight) / 2.0, (box.top + box.bottom) / 2.0, 0.5);
  } else {
    const Axis axis = axis_of(panel, picture);
    draw_levels(canvas, panel, axis);
    for (const Line& line : panel.lines) draw_line(canvas, picture, line, box, axis, time);
    draw_legend(canvas, panel);
  }
  canvas.colour(kFrame);
  canvas.hair(kLeft, box.top, kLeft, box.bottom);
  canvas.hair(kLeft, box.bottom, kRight, box.bottom);
}

void draw_event(Canvas& canvas, const TrendPicture& picture, const TimeAxis& time) {
  if (picture.event_ms < picture.stretch.from_ms || picture.event_ms > picture.stretch.to_ms) {
    return;
  }
  const double x = time.at(picture.event_ms);
  canvas.colour(kEvent);
  canvas.dash(true, 3.0);
  canvas.hair(x, kMark - 9.0, x, kUpper.bottom);
  canvas.hair(x, kLower.top, x, kLower.bottom);
  canvas.dash(false);
  canvas.font(kSmall);
  const double part = x > (kLeft + kRight) / 2.0 ? 1.0 : 0.0;
  canvas.text(clock_text(picture.event_ms, *picture.zone, "alarm %T"),
              x + (part > 0.5 ? -4.0 : 4.0), kMark, part);
}

}  // namespace

std::string png_of(const TrendPicture& picture) {
  const bool something = is_there(picture, Column::kPv) || is_there(picture, Column::kCo);
  if (!something || picture.stretch.to_ms <= picture.stretch.from_ms) return "";
  Canvas canvas;
  canvas.colour(kInk);
  canvas.font(kLarge, true);
  canvas.text_within(one_line(picture.title), kLeft - 48.0, 26.0, kRight - kLeft + 48.0);
  const TimeAxis time{static_cast<double>(picture.stretch.from_ms),
                      static_cast<double>(picture.stretch.to_ms)};
  draw_times(canvas, picture, time);
  draw_panel(canvas, picture,
             {kUpper,
              picture.pv_unit,
              picture.pv_range,
              {{"SP", Column::kSp, kSetPoint, true}, {"PV", Column::kPv, kInk, false}}},
             time);
  draw_panel(
      canvas, picture,
      {kLower,
       picture.co_unit,
       picture.co_range,
       {{"valve travel", Column::kStem, kTravel, false}, {"CO", Column::kCo, kOutput, false}}},
      time);
  draw_event(canvas, picture, time);
  return canvas.png();
}

}  // namespace loopwarden::notify
