// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace loopwarden::workbench {
namespace {

// Far outside of every picture, yet exact in the arithmetic of every viewer.
constexpr double kFarthest = 1e6;

std::int64_t height_of(double value, const PlotRange& range) {
  return std::llround(std::clamp(range.down(value), -kFarthest, kFarthest));
}

bool on_a_line(const PlotPoint& a, const PlotPoint& b, const PlotPoint& c) {
  return (b.x - a.x) * (c.y - a.y) == (c.x - a.x) * (b.y - a.y);
}

void add(std::vector<PlotPoint>& points, const PlotPoint& point) {
  const std::size_t n = points.size();
  if (!point.starts && n >= 2 && !points[n - 1].starts &&
      on_a_line(points[n - 2], points[n - 1], point)) {
    points.back() = point;
    return;
  }
  points.push_back(point);
}

// Returns the distance of `p` from the line segment from `a` to `b`.
double distance(const PlotPoint& p, const PlotPoint& a, const PlotPoint& b) {
  const auto dx = static_cast<double>(b.x - a.x);
  const auto dy = static_cast<double>(b.y - a.y);
  const auto px = static_cast<double>(p.x - a.x);
  const auto py = static_cast<double>(p.y - a.y);
  const double length = dx * dx + dy * dy;
  const double along = length > 0.0 ? std::clamp((px * dx + py * dy) / length, 0.0, 1.0) : 0.0;
  return std::hypot(px - along * dx, py - along * dy);
}

}  // namespace

PlotRange range_of(std::span<const std::span<const double>> columns, double margin) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const std::span<const double> column : columns) {
    for (const double value : column) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  if (low > high) return {};
  // With a smaller step, all ticks would have the same text.
  const double least = std::max(1e-9, 1e-6 * std::max(std::abs(low), std::abs(high)));
  if (high - low < least) {
    const double room = std::max(0.5 * std::abs(low) * 0.1, 10.0 * least);
    return {low - room, high + room};
  }
  const double more = margin * (high - low);
  return {low - more, high + more};
}

std::vector<Tick> ticks(const PlotRange& range, int count) {
  const double raw = range.span() / count;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * decade;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= raw) {
      step = factor * decade;
      break;
    }
  }
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  std::vector<Tick> result;
  const double first = std::ceil(range.low / step - 1e-9);
  for (double i = first; i * step <= range.high + 1e-9 * step; i += 1.0) {
    const double value = i * step + 0.0;  // no "-0"
    result.push_back({value, fmt::format("{:.{}f}", value, decimals)});
  }
  return result;
}

std::vector<PlotPoint> decimated(std::span<const double> values, const PlotRange& range,
                                 std::size_t columns) {
  std::vector<PlotPoint> points;
  const std::size_t n = values.size();
  const std::size_t stretches = n <= 2 * columns ? n : columns;
  bool gap = true;
  const auto keep = [&](std::size_t k) {
    add(points, {static_cast<std::int64_t>(k), height_of(values[k], range), gap});
    gap = false;
  };
  for (std::size_t i = 0; i < stretches; ++i) {
    const std::size_t begin = i * n / stretches;
    const std::size_t end = (i + 1) * n / stretches;
    std::size_t least = end;
    std::size_t most = end;
    for (std::size_t k = begin; k < end; ++k) {
      if (!std::isfinite(values[k])) continue;
      if (least == end || values[k] < values[least]) least = k;
      if (most == end || values[k] > values[most]) most = k;
    }
    if (least == end) {
      gap = true;
      continue;
    }
    keep(std::min(least, most));
    if (least != most) keep(std::max(least, most));
  }
  return points;
}

std::vector<PlotPoint> simplified(std::span<const PlotPoint> points, double tolerance) {
  std::vector<bool> kept(points.size(), false);
  std::vector<std::pair<std::size_t, std::size_t>> open;
  for (std::size_t begin = 0; begin < points.size();) {
    std::size_t end = begin + 1;
    while (end < points.size() && !points[end].starts) ++end;
    kept[begin] = kept[end - 1] = true;
    open.emplace_back(begin, end - 1);
    begin = end;
  }
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    double most = tolerance;
    std::size_t farthest = last;
    for (std::size_t k = first + 1; k < last; ++k) {
      const double d = distance(points[k], points[first], points[last]);
      if (d > most) {
        most = d;
        farthest = k;
      }
    }
    if (farthest == last) continue;
    kept[farthest] = true;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
  std::vector<PlotPoint> result;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (kept[k]) result.push_back(points[k]);
  }
  return result;
}

std::string path_data(std::span<const PlotPoint> points) {
  std::string text;
  PlotPoint last{};
  bool first_step = true;
  for (const PlotPoint& point : points) {
    if (point.starts) {
      text += fmt::format("M{} {}", point.x, point.y);
      first_step = true;
    } else {
      // A minus sign separates numbers as well as a blank does.
      const std::int64_t dx = point.x - last.x;
      const std::int64_t dy = point.y - last.y;
      text += fmt::format("{}{}{}{}", first_step ? "l" : (dx < 0 ? "" : " "), dx, dy < 0 ? "" : " ",
                          dy);
      first_step = false;
    }
    last = point;
  }
  return text;
}

std::string plain_number(double value) {
  if (!std::isfinite(value)) return "-";
  return fmt::format("{:.4g}", value == 0.0 ? 0.0 : value);
}

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      case '\'': result += "&#39;"; break;
      default: {
        const auto byte = static_cast<unsigned char>(c);
        const bool control = (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7f;
        result += control ? std::string("\xef\xbf\xbd") : std::string(1, c);
      }
    }
  }
  return result;
}

}  // namespace loopwarden::workbench
