// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "services/page/api/context.hpp"
#include "services/page/boxes/box_state.hpp"

namespace loopwarden::page::api {

// Returns the loop of a path, valid as long as the state. Throws ApiError 404.
const protocol::LoopDescription& loop_at(const std::shared_ptr<const BoxState>& state,
                                         std::string_view tag);

// Checks that the page may set this loop's gains. Throws ApiError 403.
void check_may_tune(const BoxState& state, const protocol::LoopDescription& loop);

// Returns the folder of the loop's segments. If the page's state directory differs from the
// daemon's (a copy, for example), the page's directory is used.
std::filesystem::path segments_of(const Context& context, const protocol::LoopDescription& loop);

}  // namespace loopwarden::page::api
