// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>

namespace loopwarden::page {

// The account of the service, if the package has made it.
struct PageAccount {
  uid_t user = 0;
  gid_t group = 0;
};
std::optional<PageAccount> page_account();

}  // namespace loopwarden::page
