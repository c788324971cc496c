// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include "services/page/box/box_state.hpp"

namespace loopwarden::page::api {

// The loop of a path, valid as long as the state. Throws ApiError 404.
const protocol::LoopDescription& loop_at(const std::shared_ptr<const BoxState>& state,
                                         std::string_view tag);

}  // namespace loopwarden::page::api
