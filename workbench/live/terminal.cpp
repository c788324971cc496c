// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/terminal.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace loopwarden::workbench {
namespace {

volatile std::sig_atomic_t interrupt_seen = 0;
bool colours_on = false;

void on_interrupt(int) { interrupt_seen = 1; }

const char* code(Colour colour) {
  switch (colour) {
    case Colour::grey: return "\x1b[90m";
    case Colour::green: return "\x1b[32m";
    case Colour::yellow: return "\x1b[33m";
    case Colour::red: return "\x1b[31m";
    case Colour::cyan: return "\x1b[36m";
    case Colour::magenta: return "\x1b[35m";
    case Colour::bold: return "\x1b[1m";
    case Colour::plain: break;
  }
  return "";
}

std::string braille(unsigned dots) {
  // U+2800 + dots, in UTF-8.
  return {static_cast<char>(0xE2), static_cast<char>(0xA0 | (dots >> 6U)),
          static_cast<char>(0x80 | (dots & 0x3FU))};
}

// Dots of a braille character by column (0, 1) and row (0 at the top to 3).
constexpr std::array<std::array<unsigned, 4>, 2> kDots{
    {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}}};

struct Cell {
  unsigned dots = 0;
  Colour colour = Colour::plain;
};

std::size_t cell_index(int row, int column, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

// Draws one series into the cells. Later series set the colour of a shared cell.
void draw(const Series& series, double low, double high, int columns, int rows, int samples_per_dot,
          std::vector<Cell>& cells) {
  const int width = columns * 2;
  const int height = rows * 4;
  const auto row_of = [&](double value) {
    const double share = std::clamp((value - low) / (high - low), 0.0, 1.0);
    return static_cast<int>(std::lround((1.0 - share) * (height - 1)));
  };
  const auto count = static_cast<int>(series.values.size());
  int previous = -1;
  for (int x = 0; x < width; ++x) {
    const int end = count - (width - 1 - x) * samples_per_dot;
    int top = height;
    int bottom = -1;
    for (int i = std::max(end - samples_per_dot, 0); i < end; ++i) {
      const double value = series.values[static_cast<std::size_t>(i)];
      if (!std::isfinite(value)) continue;
      const int row = row_of(value);
      top = std::min(top, row);
      bottom = std::max(bottom, row);
      // A vertical stroke joins neighbouring samples, so that steps and slips stay visible.
      if (previous >= 0) {
        top = std::min(top, previous);
        bottom = std::max(bottom, previous);
      }
      previous = row;
    }
    if (bottom < 0) previous = -1;
    for (int row = top; row <= bottom; ++row) {
      Cell& cell = cells[cell_index(row / 4, x / 2, columns)];
      cell.dots |= kDots[static_cast<std::size_t>(x % 2)][static_cast<std::size_t>(row % 4)];
      cell.colour = series.colour;
    }
  }
}

}  // namespace

bool is_terminal(int fd) { return isatty(fd) == 1; }

TerminalSize terminal_size() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0) {
    return {size.ws_col, size.ws_row};
  }
  return {};
}

void use_colours(bool on) { colours_on = on && std::getenv("NO_COLOR") == nullptr; }

std::string coloured(std::string text, Colour colour) {
  if (!colours_on || colour == Colour::plain) return text;
  return code(colour) + std::move(text) + "\x1b[0m";
}

Screen::Screen() {
  tcgetattr(STDIN_FILENO, &before_);
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  std::fputs("\x1b[?1049h\x1b[?25l", stdout);
  std::fflush(stdout);
}

Screen::~Screen() {
  std::fputs("\x1b[?25h\x1b[?1049l", stdout);
  std::fflush(stdout);
  tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

void Screen::show(const std::string& text) {
  std::string out = "\x1b[H";
  int rows = terminal_size().rows;
  for (std::size_t begin = 0; begin <= text.size() && rows > 0; --rows) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    out.append(text, begin, end - begin);
    out += "\x1b[K";
    if (rows > 1) out += "\r\n";
    begin = end + 1;
  }
  out += "\x1b[J";
  std::fputs(out.c_str(), stdout);
  std::fflush(stdout);
}

std::optional<char> Screen::key(std::chrono::milliseconds timeout) {
  pollfd waiting{STDIN_FILENO, POLLIN, 0};
  if (poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
  std::array<char, 8> buffer{};
  const ssize_t n = read(STDIN_FILENO, buffer.data(), buffer.size());
  if (n <= 0) return std::nullopt;
  if (n >= 3 && buffer[0] == '\x1b' && buffer[1] == '[') {
    if (buffer[2] == 'A') return 'U';
    if (buffer[2] == 'B') return 'D';
    return std::nullopt;
  }
  return buffer[0];
}

void watch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGQUIT, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);  // the terminal is gone
}

bool interrupted() noexcept { return interrupt_seen != 0; }

std::vector<std::string> plot(std::span<const Series> series, double low, double high, int columns,
                              int rows, int samples_per_dot) {
  const int plot_columns = std::max(columns - kScaleColumns, 1);
  std::vector<Cell> cells(cell_index(rows, 0, plot_columns));
  for (const Series& s : series) {
    draw(s, low, high, plot_columns, rows, samples_per_dot, cells);
  }

  std::vector<std::string> lines;
  for (int row = 0; row < rows; ++row) {
    std::string label;
    if (row == 0) label = fmt::format("{:.4g}", high);
    if (row == rows - 1) label = fmt::format("{:.4g}", low);
    std::string line = coloured(fmt::format("{:>{}} ", label, kScaleColumns - 2), Colour::grey) +
                       coloured("│", Colour::grey);
    for (int column = 0; column < plot_columns; ++column) {
      const Cell& cell = cells[cell_index(row, column, plot_columns)];
      line += cell.dots == 0 ? std::string(" ") : coloured(braille(cell.dots), cell.colour);
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace loopwarden::workbench
