// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::page::files {

// `html` with its stylesheets and scripts inside. A report is shown with an origin of its own, from which it may fetch nothing, so
// what lies beside it has to come with it. `page`: its path below the report's folder; `read`: a file by such a path. What can't
// be read, leads out of the folder or would end its own element stays as it is.
std::string self_contained(
    std::string_view html, const std::vector<std::string>& page,
    const std::function<std::optional<std::string>(const std::vector<std::string>&)>& read);

}  // namespace loopwarden::page::files
