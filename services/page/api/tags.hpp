// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "services/page/api/context.hpp"
#include "services/page/boxes/box_state.hpp"

namespace loopwarden::page::api {

// The loop of a path, valid as long as the state. Throws ApiError 404.
const protocol::LoopDescription& loop_at(const std::shared_ptr<const BoxState>& state,
                                         std::string_view tag);

// Throws ApiError 403.
void check_may_tune(const BoxState& state, const protocol::LoopDescription& loop);

// Where the recorder keeps the loop's segments: where the page's state directory is another than the daemon's, such as a copy,
// it is the page's.
std::filesystem::path segments_of(const Context& context, const protocol::LoopDescription& loop);

}  // namespace loopwarden::page::api
