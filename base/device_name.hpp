// SPDX-License-Identifier: Apache-2.0
// One spelling for names that several spellings reach: whether two links lead to one device.
#pragma once

#include <string>

namespace loopwarden::base {

// Returns the numeric address that a link to `name` connects to: localhost is 127.0.0.1, an IPv4
// address in the form of IPv6 is IPv4, the address of any interface is this host. A text that is
// no address is returned in lower case.
std::string address_name(const std::string& name);

// Returns the path of the device file with symbolic links followed, also where the file is absent
// at present.
std::string device_name(const std::string& path);

}  // namespace loopwarden::base
