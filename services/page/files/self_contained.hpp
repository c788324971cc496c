// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::page::files {

// Returns `html` with its stylesheets and scripts inside. A report is shown with a separate origin,
// which may not fetch files, so its page must contain them. `page`: its path below the report's
// folder. `read`: returns a file for such a path. A link stays as it is if its file can't be read,
// is outside the folder, or would end its own element.
std::string self_contained(
    std::string_view html, const std::vector<std::string>& page,
    const std::function<std::optional<std::string>(const std::vector<std::string>&)>& read);

}  // namespace loopwarden::page::files
