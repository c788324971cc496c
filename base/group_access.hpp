// SPDX-License-Identifier: Apache-2.0
// One group more for a file, by its access control list (acl(5)). A file that is given away by chown would need a system
// call that the daemon's unit denies, and the daemon would have to be a member of the group.
#pragma once

#include <optional>
#include <string>

namespace loopwarden::base {

// The number of a group by its name; nullopt if there is none. May ask a directory service: not for a thread in a hurry.
std::optional<unsigned> group_id(const std::string& name);
// The same of a user.
std::optional<unsigned> user_id(const std::string& name);

struct GroupRights {
  bool read = false;
  bool write = false;
  bool execute = false;  // of a folder: to reach what is in it
};

// False, and all is as it was, where the file is another's or its file system has no such lists.
bool admit_group(const std::string& path, unsigned group, const GroupRights& rights) noexcept;

}  // namespace loopwarden::base
