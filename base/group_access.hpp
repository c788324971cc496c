// SPDX-License-Identifier: Apache-2.0
// Gives one more group access to a file, by the access control list (acl(5)). chown is no
// alternative: the daemon's unit denies its system call, and the daemon would have to be a member
// of the group.
#pragma once

#include <optional>
#include <string>

namespace loopwarden::base {

// Returns the number of the group `name`; nullopt if it does not exist. May query a directory
// service: not for real-time threads.
std::optional<unsigned> group_id(const std::string& name);
// Returns the number of the user `name`, as group_id().
std::optional<unsigned> user_id(const std::string& name);

struct GroupRights {
  bool read = false;
  bool write = false;
  bool execute = false;  // for folders: access to the files in it
};

// Returns false, without a change, if another user owns the file or its file system has no access
// control lists.
bool admit_group(const std::string& path, unsigned group, const GroupRights& rights) noexcept;

}  // namespace loopwarden::base
