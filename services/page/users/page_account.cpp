// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/page_account.hpp"

#include <pwd.h>

namespace loopwarden::page {

std::optional<PageAccount> page_account() {
  const passwd* entry = ::getpwnam("loopwarden-page");
  if (entry == nullptr) return std::nullopt;
  return PageAccount{entry->pw_uid, entry->pw_gid};
}

}  // namespace loopwarden::page
