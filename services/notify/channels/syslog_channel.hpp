// SPDX-License-Identifier: Apache-2.0
// Sends syslog (RFC 5424) to the local socket or by UDP (RFC 5426), TCP with octet counting (RFC
// 6587) or TLS (RFC 5425).
//
// A datagram counts as sent when it has left; over TCP and TLS, when the collector's TCP has
// confirmed it. Syslog has no report of the collector's further processing.
#pragma once

#include <memory>
#include <string>

#include "services/notify/channels/channel.hpp"
#include "services/notify/channels/curl_request.hpp"

namespace loopwarden::notify {

class SyslogChannel final : public Channel {
 public:
  SyslogChannel(SyslogSettings settings, Sender sender);
  ~SyslogChannel() override;
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  Delivery send_datagram(const std::string& line);
  Delivery send_stream(const std::string& line, const std::atomic<bool>& quit);
  std::string open_datagram();
  bool connection_lives();

  SyslogSettings settings_;
  Sender sender_;
  int datagram_ = -1;
  std::unique_ptr<CurlRequest> stream_;
};

}  // namespace loopwarden::notify
