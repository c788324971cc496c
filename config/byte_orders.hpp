// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "config/io_reader.hpp"

namespace loopwarden::config {

inline constexpr auto kByteOrders =
    std::to_array<Choice<hal::modbus::ByteOrder>>({{"abcd", hal::modbus::ByteOrder::abcd},
                                                   {"cdab", hal::modbus::ByteOrder::cdab},
                                                   {"badc", hal::modbus::ByteOrder::badc},
                                                   {"dcba", hal::modbus::ByteOrder::dcba}});

}  // namespace loopwarden::config
