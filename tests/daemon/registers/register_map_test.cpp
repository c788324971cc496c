// SPDX-License-Identifier: Apache-2.0
#include "daemon/registers/register_map.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <string>
#include <tuple>

namespace register_map_test {

using namespace loopwarden::registers;
using loopwarden::hal::modbus::RegisterType;

TEST_CASE("every register is found at its stated place, for every loop", "[register_map]") {
  constexpr std::size_t kLoops = 3;
  for (const Register& reg : registers()) {
    for (std::size_t loop = 0; loop < (reg.area == Area::box ? 1 : kLoops); ++loop) {
      for (std::uint16_t word = 0; word < width(reg); ++word) {
        const Place place = find(reg.table, address(reg, loop) + word, kLoops);
        INFO(reg.name << " of loop " << loop);
        REQUIRE(place.in_map);
        CHECK(place.reg == &reg);
        CHECK(place.word == word);
        if (reg.area != Area::box) CHECK(place.loop == loop);
      }
    }
  }
}

TEST_CASE("a block is reserved between its fields, and there are no registers after the last loop",
          "[register_map]") {
  CHECK(find(Table::input_register, 50, 2).in_map);
  CHECK(find(Table::input_register, 50, 2).reg == nullptr);
  CHECK(find(Table::holding_register, 32 + 30, 2).reg == nullptr);
  CHECK(find(Table::input_register, 64 + 2 * 64 - 1, 2).in_map);
  CHECK_FALSE(find(Table::input_register, 64 + 2 * 64, 2).in_map);
  CHECK_FALSE(find(Table::input_register, 64, 0).in_map);
  CHECK_FALSE(find(Table::coil, 16 + 16, 1).in_map);
  CHECK(kMostLoops == 895);
  CHECK(find(Table::input_register, 0xE000 - 1, 5000).loop == 894);
  // Each second block ends with three reserved registers. No registers follow the last one.
  CHECK(find(Table::input_register, 0xE000 + 8 + 5, 2).in_map);
  CHECK(find(Table::input_register, 0xE000 + 8 + 5, 2).reg == nullptr);
  CHECK_FALSE(find(Table::input_register, 0xE000 + 2 * 8, 2).in_map);
  CHECK(find(Table::input_register, 0xE000 + 895 * 8 - 1, 5000).loop == 894);
  CHECK_FALSE(find(Table::input_register, 0xE000 + 895 * 8, 5000).in_map);
  // The third blocks begin in the middle of the addresses.
  CHECK_FALSE(find(Table::holding_register, 32767, 5000).in_map);
  CHECK(find(Table::holding_register, 32768 + 32 + 31, 2).in_map);
  CHECK_FALSE(find(Table::holding_register, 32768 + 64, 2).in_map);
  CHECK(find(Table::holding_register, 32768 + 895 * 32 - 1, 5000).loop == 894);
  CHECK_FALSE(find(Table::holding_register, 32768 + 895 * 32, 5000).in_map);
  CHECK(find(Table::coil, 32768 + 4 + 3, 2).loop == 1);
  CHECK(find(Table::coil, 32768 + 4 + 3, 2).in_map);
  CHECK_FALSE(find(Table::coil, 32768 + 8, 2).in_map);
  CHECK_FALSE(find(Table::discrete_input, 32768, 2).in_map);
}

TEST_CASE("the names of a table's registers are unique; blocks are short enough for any master",
          "[register_map]") {
  std::set<std::tuple<Table, Area, std::string>> names;
  for (const Register& reg : registers()) {
    INFO(reg.name);
    CHECK(names.emplace(reg.table, reg.area, reg.name).second);
    CHECK_FALSE(std::string(reg.meaning).empty());
    const Layout l = layout(reg.table);
    CHECK(l.loop_stride <= 64);
    CHECK(l.box_size <= 64);
    CHECK(l.first_loop >= l.box_size);
    // A discrete input or a coil is one bit.
    if (reg.table == Table::discrete_input || reg.table == Table::coil) CHECK(width(reg) == 1);
  }
}

// Masters in the field have these places in their configuration.
TEST_CASE("promised places don't change", "[register_map]") {
  struct Promise {
    Table table;
    std::uint32_t address;
    const char* name;
    RegisterType type;
  };
  constexpr std::size_t kLoops = 2;
  for (const Promise& promise : {
           Promise{Table::input_register, 0, "magic", RegisterType::u16},
           Promise{Table::input_register, 1, "map_version", RegisterType::u16},
           Promise{Table::input_register, 2, "heartbeat", RegisterType::u16},
           Promise{Table::input_register, 14, "float_test", RegisterType::f32},
           Promise{Table::input_register, 16, "integer_test", RegisterType::u32},
           Promise{Table::input_register, 64, "sequence_head", RegisterType::u16},
           Promise{Table::input_register, 70, "sp", RegisterType::f32},
           Promise{Table::input_register, 72, "pv", RegisterType::f32},
           Promise{Table::input_register, 74, "co", RegisterType::f32},
           Promise{Table::input_register, 76, "stem", RegisterType::f32},
           Promise{Table::input_register, 113, "alarm_stiction", RegisterType::u16},
           Promise{Table::input_register, 127, "sequence_tail", RegisterType::u16},
           Promise{Table::input_register, 136, "pv", RegisterType::f32},
           Promise{Table::input_register, 39, "first_condition", RegisterType::u16},
           Promise{Table::input_register, 57344, "condition_control_performance",
                   RegisterType::i16},
           Promise{Table::input_register, 57353, "condition_valve", RegisterType::i16},
           Promise{Table::input_register, 57356, "condition_environment", RegisterType::i16},
           Promise{Table::discrete_input, 32, "active_stiction", RegisterType::u16},
           Promise{Table::discrete_input, 37, "unacknowledged_stiction", RegisterType::u16},
           Promise{Table::holding_register, 0, "master_heartbeat", RegisterType::u16},
           Promise{Table::holding_register, 32, "mode", RegisterType::u16},
           Promise{Table::holding_register, 34, "sp", RegisterType::f32},
           Promise{Table::holding_register, 36, "output", RegisterType::f32},
           Promise{Table::holding_register, 66, "sp", RegisterType::f32},
           Promise{Table::coil, 0, "acknowledge_all", RegisterType::u16},
           Promise{Table::coil, 16, "acknowledge_stiction", RegisterType::u16},
           Promise{Table::input_register, 41, "first_third", RegisterType::u16},
           Promise{Table::input_register, 78, "jacket_rate", RegisterType::f32},
           Promise{Table::holding_register, 32768, "jacket_rate", RegisterType::f32},
           Promise{Table::holding_register, 32772, "compensator", RegisterType::f32},
           Promise{Table::holding_register, 32800, "jacket_rate", RegisterType::f32},
           Promise{Table::holding_register, 32808, "orders_refused", RegisterType::u16},
           Promise{Table::holding_register, 32782, "unshelve_process", RegisterType::u16},
           Promise{Table::holding_register, 32796, "process_active", RegisterType::u16},
           Promise{Table::holding_register, 32799, "process_suppressed", RegisterType::u16},
           Promise{Table::coil, 32771, "acknowledge_process", RegisterType::u16},
       }) {
    const Place place = find(promise.table, promise.address, kLoops);
    INFO(promise.name);
    REQUIRE(place.reg != nullptr);
    CHECK(std::string(place.reg->name) == promise.name);
    CHECK(place.reg->type == promise.type);
    CHECK(place.word == 0);
  }
}

TEST_CASE(
    "the third block is read-only except for orders about alarms, and reserved places stay free",
    "[register_map]") {
  for (const Register& reg : registers()) {
    if (reg.area == Area::third && reg.table == Table::holding_register) {
      CHECK(writable(reg) == (reg.field == Field::shelve_minutes ||
                              reg.field == Field::unshelve_process || reg.field == Field::calm));
    }
    if (reg.area == Area::loop && reg.table == Table::holding_register) {
      CHECK(writable(reg) == (reg.field != Field::moves_phase && reg.field != Field::moves_gain));
    }
    if (reg.table == Table::input_register) CHECK_FALSE(writable(reg));
  }
  for (const Reserved& place : reserved()) {
    INFO(place.meaning);
    for (std::uint32_t word = 0; word < place.words; ++word) {
      const Place found =
          find(place.table, layout(place.table).first_third + place.offset + word, 1);
      CHECK(found.in_map);
      CHECK(found.reg == nullptr);
    }
  }
}

}  // namespace register_map_test
