// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/read_batch.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <deque>
#include <vector>

#include "tests/hal/modbus/modbus_rig.hpp"

namespace read_batch_test {

using namespace loopwarden;
using namespace loopwarden::test;
using mb::RegisterType;

namespace {

constexpr std::int64_t kNow = 1'000'000'000;

struct Tasks {
  mb::LinkTask& add(std::uint16_t address, RegisterType type = RegisterType::u16) {
    mb::LinkTask& task = all.emplace_back();
    task.yields = true;
    task.due_ns = kNow;
    task.reads.push_back(std::make_unique<mb::ReadPoint>(input(address, type)));
    listed.push_back(&task);
    return task;
  }
  mb::ReadShape gathered(mb::LinkTask& first, int most = 125) {
    gather(first, listed, kNow, most, batch);
    return joint_shape(batch);
  }
  bool has(const mb::LinkTask& task) const {
    return std::find(batch.begin(), batch.end(), &task) != batch.end();
  }

  std::deque<mb::LinkTask> all;
  std::vector<mb::LinkTask*> listed;
  std::vector<mb::LinkTask*> batch;
};

}  // namespace

TEST_CASE("a request spans neighbouring registers, below and above", "[modbus]") {
  Tasks tasks;
  tasks.add(100, RegisterType::f32);
  mb::LinkTask& first = tasks.add(110, RegisterType::f32);
  tasks.add(120);              // after a gap of eight
  tasks.add(100);              // shares a register
  auto& far = tasks.add(130);  // after one of nine
  const mb::ReadShape shape = tasks.gathered(first);
  CHECK(shape.address == 100);
  CHECK(shape.count == 21);
  CHECK(shape.needed == 21);
  CHECK(tasks.batch.size() == 4);
  CHECK_FALSE(tasks.has(far));
}

TEST_CASE("a request has 125 registers at most", "[modbus]") {
  Tasks tasks;
  mb::LinkTask& first = tasks.add(0);
  for (std::uint16_t address = 4; address < 300; address += 4) tasks.add(address);
  const mb::ReadShape shape = tasks.gathered(first);
  CHECK(shape.address == 0);
  CHECK(shape.count == 125);
  CHECK(tasks.batch.size() == 32);
}

TEST_CASE("points that a request must not serve are left out", "[modbus]") {
  Tasks tasks;
  mb::LinkTask& first = tasks.add(0);
  mb::LinkTask& soon = tasks.add(1);
  soon.due_ns = kNow + soon.period_ns / 20;
  tasks.add(2).due_ns = kNow + soon.period_ns / 5;
  tasks.add(30).period_ns *= 2;
  tasks.add(4).yields = false;  // of a loop that is controlled here
  mb::LinkTask& trusted = tasks.add(5);
  mb::PointSettings with_status = input(5, RegisterType::u16);
  with_status.status = mb::StatusRegister{};
  trusted.reads[0] = std::make_unique<mb::ReadPoint>(with_status);
  mb::LinkTask& elsewhere = tasks.add(6);
  elsewhere.reads[0] =
      std::make_unique<mb::ReadPoint>(input(6, RegisterType::u16, mb::ByteOrder::abcd, 1.0, 2));
  mb::LinkTask& other_table = tasks.add(7);
  mb::PointSettings holding = input(7, RegisterType::u16);
  holding.reg.table = mb::Table::holding_register;
  other_table.reads[0] = std::make_unique<mb::ReadPoint>(holding);
  const mb::ReadShape shape = tasks.gathered(first);
  CHECK(shape.count == 2);
  CHECK(tasks.batch.size() == 2);
  CHECK(tasks.has(soon));

  first.apart = true;
  (void)tasks.gathered(first);
  CHECK(tasks.batch.size() == 1);
  CHECK(tasks.has(first));
}

TEST_CASE("a register that a device refuses splits a run, which stays whole on both sides",
          "[modbus]") {
  Tasks tasks;
  std::vector<mb::LinkTask*> all;
  for (std::uint16_t address = 0; address < 10; ++address) all.push_back(&tasks.add(address));
  CHECK(tasks.gathered(*all[9]).count == 10);
  CHECK(tasks.gathered(*all[9], 4).count == 2);  // 4, 4 and 2
  all[4]->apart = true;
  CHECK(tasks.gathered(*all[0]).count == 4);
  CHECK(tasks.gathered(*all[4]).count == 1);
  CHECK(tasks.gathered(*all[9]).address == 5);
  all[7]->cut_before = true;
  CHECK(tasks.gathered(*all[9]).address == 7);
  CHECK(tasks.gathered(*all[5]).count == 2);
}

TEST_CASE("a refused batch is split at its widest gap, or without one in the middle", "[modbus]") {
  Tasks tasks;
  for (std::uint16_t address = 0; address < 4; ++address) tasks.add(address);
  (void)tasks.gathered(*tasks.listed[0]);
  CHECK(parting(tasks.batch) == 2);
  tasks.add(8);
  tasks.add(11);
  (void)tasks.gathered(*tasks.listed[0]);
  CHECK(tasks.batch.size() == 6);
  CHECK(parting(tasks.batch) == 4);
}

}  // namespace read_batch_test
