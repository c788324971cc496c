// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include "services/page/box/plant.hpp"

namespace loopwarden::page::api {

// The loop of a path, valid as long as the plant. Throws ApiError 404.
const PlantLoop& loop_at(const std::shared_ptr<const Plant>& plant, std::string_view tag);

}  // namespace loopwarden::page::api
