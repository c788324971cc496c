// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "config/io_reader.hpp"

namespace loopwarden::config {

inline constexpr std::array kByteOrders{
    Choice<hal::modbus::ByteOrder>{"abcd", hal::modbus::ByteOrder::abcd},
    Choice<hal::modbus::ByteOrder>{"cdab", hal::modbus::ByteOrder::cdab},
    Choice<hal::modbus::ByteOrder>{"badc", hal::modbus::ByteOrder::badc},
    Choice<hal::modbus::ByteOrder>{"dcba", hal::modbus::ByteOrder::dcba}};

}  // namespace loopwarden::config
