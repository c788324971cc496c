// SPDX-License-Identifier: Apache-2.0
#include "config/specialists/weights_text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace loopwarden::config {
namespace {

constexpr std::string_view kHeading = "loopwarden-weights 1\n";

void append(std::string& text, double value, char end) {
  fmt::format_to(std::back_inserter(text), "{}{}", static_cast<float>(value), end);
}

// Splits a text into numbers with their places.
class Numbers {
 public:
  Numbers(std::string_view text, int line) : text_(text), line_(line) {}

  bool next(float& value) {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) {
      if (text_[at_] == '\n') {
        ++line_;
        line_start_ = at_ + 1;
      }
      ++at_;
    }
    if (at_ == text_.size()) return false;
    const char* const from = text_.data() + at_;
    const auto [end, error] = std::from_chars(from, text_.data() + text_.size(), value);
    failed_ = error != std::errc() || !std::isfinite(value) ||
              (end != text_.data() + text_.size() && *end != ' ' && *end != '\n');
    place_ = {line_, static_cast<int>(at_ - line_start_) + 1};
    at_ = static_cast<std::size_t>(end - text_.data());
    return !failed_;
  }
  bool failed() const noexcept { return failed_; }
  bool done() const noexcept { return !failed_ && at_ == text_.size(); }
  Place place() const noexcept { return place_; }

 private:
  std::string_view text_;
  int line_;
  std::size_t at_ = 0;
  std::size_t line_start_ = 0;
  bool failed_ = false;
  Place place_{1, 1};
};

}  // namespace

std::string weights_text(const specialist::Network& network, const std::vector<double>& target) {
  std::string text(kHeading);
  for (const specialist::Layer& layer : network.layers) {
    for (Eigen::Index i = 0; i < layer.weights.rows(); ++i) {
      for (Eigen::Index k = 0; k < layer.weights.cols(); ++k)
        append(text, layer.weights(i, k), ' ');
      append(text, layer.bias(i), '\n');
    }
  }
  for (std::size_t k = 0; k < target.size(); ++k)
    append(text, target[k], k % 31 == 30 ? '\n' : ' ');
  return text;
}

std::optional<Weights> parse_weights(std::string_view text, const specialist::NetworkShape& shape,
                                     std::size_t target_samples, Report& report) {
  if (!text.starts_with(kHeading)) {
    report.error({1, 1}, "", "is no file of weights: it must begin with 'loopwarden-weights 1'");
    return std::nullopt;
  }
  Numbers numbers(text.substr(kHeading.size()), 2);
  Weights weights{specialist::Network(shape), {}};
  std::size_t count = 0;
  float value = 0.0F;
  const auto next = [&](double& to) {
    if (!numbers.next(value)) return false;
    to = static_cast<double>(value);
    ++count;
    return true;
  };
  bool complete = true;
  for (specialist::Layer& layer : weights.network.layers) {
    for (Eigen::Index i = 0; complete && i < layer.weights.rows(); ++i) {
      for (Eigen::Index k = 0; complete && k < layer.weights.cols(); ++k) {
        complete = next(layer.weights(i, k));
      }
      complete = complete && next(layer.bias(i));
    }
  }
  weights.target.resize(target_samples);
  for (std::size_t k = 0; complete && k < target_samples; ++k) complete = next(weights.target[k]);
  const std::size_t wanted = shape.weights() + target_samples;
  if (numbers.failed()) {
    report.error(numbers.place(), "", "must be a finite number");
    return std::nullopt;
  }
  const bool more = complete && numbers.next(value);
  if (!complete || more || numbers.failed()) {
    report.error({}, "",
                 fmt::format("must hold {} numbers (layers {}-{}-{}-{}{}), has {}", wanted,
                             shape.inputs, shape.first_hidden, shape.second_hidden, shape.outputs,
                             target_samples > 0 ? " and the target" : "",
                             complete ? "more" : std::to_string(count)));
    return std::nullopt;
  }
  return weights;
}

}  // namespace loopwarden::config
