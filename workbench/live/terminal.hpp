// SPDX-License-Identifier: Apache-2.0
// Draws in a terminal: size, colours, keys, and a plot in braille dots.
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

// ANSI colour of a text. The text is plain if colours are off (NO_COLOR, not a terminal).
enum class Colour : std::uint8_t { plain, grey, green, yellow, red, cyan, magenta, bold };
void use_colours(bool on);
std::string coloured(std::string text, Colour colour);

// Full-screen mode with single keys. The destructor restores the terminal, also after Ctrl-C.
class Screen {
 public:
  Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen();

  // Replaces the shown text without flicker. Lines beyond the screen are cut.
  void show(const std::string& text);
  // Returns the next key within `timeout`: a character, or 'U', 'D' for the arrows up and down.
  std::optional<char> key(std::chrono::milliseconds timeout);

 private:
  termios before_{};
};

// Returns true after Ctrl-C, SIGTERM or SIGHUP, provided that watch_interrupts() was called before.
void watch_interrupts();
bool interrupted() noexcept;

struct Series {
  std::span<const double> values;  // oldest first; NaN: a gap
  Colour colour = Colour::plain;
};

// Number of columns that the scale of a plot takes.
inline constexpr int kScaleColumns = 8;

// Draws lines over time, with the newest value at the right edge. Each of the two dots of a column
// shows the least and the greatest of `samples_per_dot` samples. Returns `rows` lines of `columns`
// characters with a scale at the left.
std::vector<std::string> plot(std::span<const Series> series, double low, double high, int columns,
                              int rows, int samples_per_dot);

}  // namespace loopwarden::workbench
