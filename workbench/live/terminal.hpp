// SPDX-License-Identifier: Apache-2.0
// Drawing in a terminal: size, colours, keys, and a plot in braille dots.
#pragma once

#include <termios.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::workbench {

struct TerminalSize {
  int columns = 80;
  int rows = 24;
};

bool is_terminal(int fd);
TerminalSize terminal_size();

// ANSI colour of a text, or plain where colours are off (NO_COLOR, not a terminal).
enum class Colour : std::uint8_t { plain, grey, green, yellow, red, cyan, magenta, bold };
void use_colours(bool on);
std::string coloured(std::string text, Colour colour);

// Full-screen mode with single keys; the terminal is as before when this ends, also after Ctrl-C.
class Screen {
 public:
  Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen();

  // Replaces what is shown, without flicker; lines beyond the screen are cut.
  void show(const std::string& text);
  // The next key within `timeout`: a character, or 'U', 'D' for the arrows up and down.
  std::optional<char> key(std::chrono::milliseconds timeout);

 private:
  termios before_{};
};

// True once Ctrl-C was pressed, or SIGTERM or SIGHUP arrived, after watch_interrupts().
void watch_interrupts();
bool interrupted() noexcept;

struct Series {
  std::span<const double> values;  // oldest first, NaN: nothing drawn
  Colour colour = Colour::plain;
};

// Columns that a plot of this width spends on its scale.
inline constexpr int kScaleColumns = 8;

// Lines over time, the newest value at the right edge, `samples_per_dot` samples in each of the two
// dots of a column (their least and greatest are drawn). Returns `rows` lines of `columns` characters
// with a scale at the left.
std::vector<std::string> plot(std::span<const Series> series, double low, double high, int columns,
                              int rows, int samples_per_dot);

}  // namespace loopwarden::workbench
