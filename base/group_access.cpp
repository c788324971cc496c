// SPDX-License-Identifier: Apache-2.0
#include "base/group_access.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/acl.h>

#include <array>
#include <memory>

namespace loopwarden::base {
namespace {

struct FreeAcl {
  void operator()(void* acl) const noexcept { acl_free(acl); }
};

bool is_of_group(acl_entry_t entry, unsigned group) {
  acl_tag_t tag = ACL_UNDEFINED_TAG;
  if (acl_get_tag_type(entry, &tag) != 0 || tag != ACL_GROUP) return false;
  const std::unique_ptr<void, FreeAcl> id(acl_get_qualifier(entry));
  return id != nullptr && *static_cast<const gid_t*>(id.get()) == group;
}

bool set_rights(acl_entry_t entry, const GroupRights& rights) {
  acl_permset_t set = nullptr;
  if (acl_get_permset(entry, &set) != 0 || acl_clear_perms(set) != 0) return false;
  const auto add = [&](bool wanted, acl_perm_t perm) {
    return !wanted || acl_add_perm(set, perm) == 0;
  };
  return add(rights.read, ACL_READ) && add(rights.write, ACL_WRITE) &&
         add(rights.execute, ACL_EXECUTE);
}

// Returns the group's entry and creates it if missing; null if it can't be created.
acl_entry_t entry_of(acl_t& acl, unsigned group) {
  acl_entry_t entry = nullptr;
  for (int which = ACL_FIRST_ENTRY; acl_get_entry(acl, which, &entry) == 1;
       which = ACL_NEXT_ENTRY) {
    if (is_of_group(entry, group)) return entry;
  }
  const gid_t id = group;
  const bool made = acl_create_entry(&acl, &entry) == 0 &&
                    acl_set_tag_type(entry, ACL_GROUP) == 0 && acl_set_qualifier(entry, &id) == 0;
  return made ? entry : nullptr;
}

}  // namespace

std::optional<unsigned> group_id(const std::string& name) {
  std::array<char, 16384> buffer{};
  group entry{};
  group* found = nullptr;
  if (getgrnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0) return {};
  return found == nullptr ? std::nullopt : std::optional<unsigned>(found->gr_gid);
}

std::optional<unsigned> user_id(const std::string& name) {
  std::array<char, 16384> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0) return {};
  return found == nullptr ? std::nullopt : std::optional<unsigned>(found->pw_uid);
}

bool admit_group(const std::string& path, unsigned group, const GroupRights& rights) noexcept {
  acl_t list = acl_get_file(path.c_str(), ACL_TYPE_ACCESS);
  if (list == nullptr) return false;
  acl_entry_t entry = entry_of(list, group);
  const bool done = entry != nullptr && set_rights(entry, rights) && acl_calc_mask(&list) == 0 &&
                    acl_set_file(path.c_str(), ACL_TYPE_ACCESS, list) == 0;
  acl_free(list);  // its newest address: a new entry may have moved the list
  return done;
}

}  // namespace loopwarden::base
