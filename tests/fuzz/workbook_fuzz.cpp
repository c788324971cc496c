// SPDX-License-Identifier: Apache-2.0
// Reads any XML as the parts of a workbook, without a checksum. A separate line "@@NAME" begins
// each part.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "record/import/workbook.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace loopwarden::record;
using loopwarden::tests::fuzz::require;

class Part : public ByteSource {
 public:
  explicit Part(std::string_view text) : all_(text.size()), rest_(text) {}

  std::size_t read(char* to, std::size_t most) override {
    const std::size_t taken = std::min(most, rest_.size());
    std::copy_n(rest_.data(), taken, to);
    rest_.remove_prefix(taken);
    return taken;
  }
  double share_read() const noexcept override {
    return all_ == 0 ? 0.0 : 1.0 - static_cast<double>(rest_.size()) / static_cast<double>(all_);
  }
  std::uint64_t unpacked_bytes() const noexcept override { return all_; }
  const char* packing() const noexcept override { return ""; }

 private:
  std::size_t all_;
  std::string_view rest_;
};

std::map<std::string, std::string_view> parts_of(std::string_view input) {
  std::map<std::string, std::string_view> parts;
  while (!input.empty()) {
    const std::size_t line = std::min(input.find('\n'), input.size());
    std::string_view name = input.substr(0, line);
    input.remove_prefix(std::min(line + 1, input.size()));
    const std::size_t end = std::min(input.find("\n@@"), input.size());
    if (name.starts_with("@@")) name.remove_prefix(2);
    parts[std::string(name)] = input.substr(0, end);
    input.remove_prefix(std::min(end + 1, input.size()));
  }
  return parts;
}

// At most 16 MiB of rows, because a row can request a million lines.
void read_sheet(Workbook& book, std::size_t sheet) {
  constexpr std::size_t kEnough = 16UL << 20U;
  const std::unique_ptr<ByteSource> source = book.open(sheet, "book/sheet");
  std::array<char, 65536> block;
  std::size_t all = 0;
  while (all < kEnough) {
    const std::size_t got = source->read(block.data(), block.size());
    require(got <= block.size(), "no more than there is room for");
    if (got == 0) break;
    require(std::find(block.begin(), block.begin() + static_cast<std::ptrdiff_t>(got), '\r') ==
                block.begin() + static_cast<std::ptrdiff_t>(got),
            "no line end within a cell");
    all += got;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parts = parts_of({reinterpret_cast<const char*>(data), size});
  try {
    Workbook book(
        [&parts](const std::string& name) -> std::unique_ptr<ByteSource> {
          const auto at = parts.find(name);
          return at == parts.end() ? nullptr : std::make_unique<Part>(at->second);
        },
        "book");
    for (std::size_t k = 0; k < book.sheets().size(); ++k) {
      try {
        read_sheet(book, k);
      } catch (const RecordError& error) {
        require(std::string_view(error.what()).starts_with("book"), "the name in the message");
      }
    }
  } catch (const RecordError& error) {
    require(std::string_view(error.what()).starts_with("book"), "the name in the message");
  }
  return 0;
}
