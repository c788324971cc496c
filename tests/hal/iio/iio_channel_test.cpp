// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/iio_channel.hpp"

#include <catch2/catch.hpp>

#include "tests/hal/iio/fake_iio.hpp"

namespace iio_channel_test {

using namespace loopwarden::hal::iio;
using loopwarden::tests::FakeIio;
namespace fs = std::filesystem;

namespace {

ChannelSettings channel_of(const char* device, const char* channel) {
  ChannelSettings settings;
  settings.device = device;
  settings.channel = channel;
  return settings;
}

struct Failure {
  ChannelError::Kind kind;
  std::string what;
};

template <class Action>
Failure failure_of(Action action) {
  try {
    action();
  } catch (const ChannelError& error) {
    return {error.kind(), error.what()};
  }
  throw std::logic_error("no failure");
}

}  // namespace

TEST_CASE("a device is found by its name or its label, whatever its number") {
  const FakeIio iio;
  iio.set(0, "name", "cpu-thermal\n");
  iio.set(3, "name", "ads1115\n");
  iio.set(7, "name", "dac8775\n");
  iio.set(7, "label", "valve board\n");
  CHECK(find_device(iio.root(), "ads1115") == iio.device(3));
  CHECK(find_device(iio.root(), "valve board") == iio.device(7));
  CHECK(find_device(iio.root(), "dac8775") == iio.device(7));
  CHECK(failure_of([&] { find_device(iio.root(), "iio:device3"); }).kind ==
        ChannelError::Kind::absent);
}

TEST_CASE("an absent device is reported with the present ones") {
  const FakeIio iio;
  iio.set(0, "name", "ads1115\n");
  iio.set(1, "name", "dac8775\n");
  iio.set(1, "label", "valve board\n");
  const Failure failure = failure_of([&] { find_device(iio.root(), "ads1015"); });
  CHECK(failure.kind == ChannelError::Kind::absent);
  CHECK_THAT(failure.what, Catch::EndsWith("'ads1015'; there: ads1115, valve board"));
  CHECK_THAT(failure_of([&] { find_device(iio.root() / "none", "x"); }).what,
             Catch::Contains("none at all"));
}

TEST_CASE("two devices of the same name are refused as ambiguous") {
  const FakeIio iio;
  iio.set(0, "name", "ads1115\n");
  iio.set(1, "name", "ads1115\n");
  CHECK_THAT(failure_of([&] { find_device(iio.root(), "ads1115"); }).what,
             Catch::Contains("2 IIO devices"));
}

TEST_CASE("a value is (raw + offset) * scale, from the channel's own or shared files") {
  const FakeIio iio;
  iio.set(0, "name", "adc\n");
  iio.set(0, "in_voltage0_raw", "1000\n");
  iio.set(0, "in_voltage1_raw", "1000\n");
  iio.set(0, "in_voltage0-voltage1_raw", "-20\n");
  iio.set(0, "in_voltage0_scale", "0.5\n");
  iio.set(0, "in_voltage_scale", "0.25\n");
  iio.set(0, "in_voltage-voltage_scale", "2\n");
  iio.set(0, "in_offset", "-200\n");
  const auto value = [&](const char* name) {
    const IioChannel channel(iio.root(), channel_of("adc", name), Direction::in);
    return channel.physical(channel.read_raw());
  };
  CHECK(value("voltage0") == 400.0);
  CHECK(value("voltage1") == 200.0);
  CHECK(value("voltage0-voltage1") == -440.0);
}

TEST_CASE("without files scale is 1 and offset 0; settings count instead of files") {
  const FakeIio iio;
  iio.set(0, "name", "adc\n");
  iio.set(0, "in_current0_raw", "7\n");
  CHECK(IioChannel(iio.root(), channel_of("adc", "current0"), Direction::in).physical(7) == 7.0);
  iio.set(0, "in_current0_scale", "3\n");
  iio.set(0, "in_current0_offset", "1\n");
  ChannelSettings settings = channel_of("adc", "current0");
  settings.scale = 10.0;
  settings.offset = 2.0;
  CHECK(IioChannel(iio.root(), settings, Direction::in).physical(7) == 90.0);
}

TEST_CASE("each reading asks the driver again") {
  const FakeIio iio;
  iio.add_board(0, "board");
  const IioChannel channel(iio.root(), channel_of("board", "current0"), Direction::in);
  CHECK(channel.read_raw() == 2400.0);
  iio.change(0, "in_current0_raw", "2401");
  CHECK(channel.read_raw() == 2401.0);
}

TEST_CASE("a raw number is written and can be read back") {
  const FakeIio iio;
  iio.add_board(0, "board");
  const IioChannel channel(iio.root(), channel_of("board", "current0"), Direction::out);
  channel.write_raw(-4095);
  CHECK(iio.get(0, "out_current0_raw") == "-4095");
  CHECK(channel.readable());
  CHECK(channel.read_raw() == -4095.0);
  // A shorter number overwrites all digits of the longer one.
  channel.write_raw(7);
  CHECK(channel.read_raw() == 7.0);
}

TEST_CASE("an unusable channel reports the file and the reason") {
  const FakeIio iio;
  iio.add_board(0, "board");
  const auto open_input = [&](const char* channel) {
    return failure_of([&] { IioChannel(iio.root(), channel_of("board", channel), Direction::in); });
  };
  CHECK(open_input("current9").kind == ChannelError::Kind::absent);
  CHECK_THAT(open_input("current9").what, Catch::Contains("in_current9_raw: can't be opened"));
  CHECK(open_input("../../secret").kind == ChannelError::Kind::absent);
  CHECK(open_input("").kind == ChannelError::Kind::absent);

  for (const char* text : {"", "abc\n", "nan\n", "12 34\n", "\n"}) {
    INFO(text);
    iio.set(0, "in_current0_raw", text);
    const IioChannel channel(iio.root(), channel_of("board", "current0"), Direction::in);
    CHECK(failure_of([&] { channel.read_raw(); }).kind == ChannelError::Kind::garbage);
  }
  iio.set(0, "in_current_scale", "0\n");
  CHECK_THAT(open_input("current0").what, Catch::Contains("scale is 0"));
  iio.set(0, "in_current_scale", "much\n");
  CHECK_THAT(open_input("current0").what, Catch::Contains("'much' is not a number"));

  fs::remove(iio.device(0) / "in_current0_raw");
  fs::remove(iio.device(0) / "in_current_scale");
  fs::create_directory(iio.device(0) / "in_current0_raw");
  const IioChannel channel(iio.root(), channel_of("board", "current0"), Direction::in);
  CHECK(failure_of([&] { channel.read_raw(); }).kind == ChannelError::Kind::refused);
}

TEST_CASE("a moved channel stays open") {
  const FakeIio iio;
  iio.add_board(0, "board");
  IioChannel first(iio.root(), channel_of("board", "current0"), Direction::in);
  IioChannel second(std::move(first));
  CHECK(second.read_raw() == 2400.0);
  IioChannel third(iio.root(), channel_of("board", "current0"), Direction::out);
  third = std::move(second);
  CHECK(third.read_raw() == 2400.0);
}

}  // namespace iio_channel_test
