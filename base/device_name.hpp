// SPDX-License-Identifier: Apache-2.0
// Returns one spelling for a name that can be spelled in several ways, to find out whether two
// links lead to one device.
#pragma once

#include <string>

namespace loopwarden::base {

// Returns the numeric address that a link to `name` connects to. localhost becomes 127.0.0.1, and
// an IPv4 address in the form of IPv6 becomes IPv4. The address of any interface becomes that of
// this host. A text that is no address is returned in lower case.
std::string address_name(const std::string& name);

// Returns the path of the device file with symbolic links followed. The file itself may be absent.
std::string device_name(const std::string& path);

}  // namespace loopwarden::base
