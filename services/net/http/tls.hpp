// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openssl/ssl.h>

#include <filesystem>
#include <string>
#include <vector>

#include "services/net/http/server.hpp"

namespace loopwarden::http {

// Returns a server's context: TLS 1.2 with forward secrecy, or 1.3. The caller frees it. Throws
// std::runtime_error with the file and the reason.
SSL_CTX* make_tls_context(const TlsFiles& files);

struct SelfSigned {
  std::string certificate;  // PEM
  std::string key;          // PEM, EC P-256
};
// Makes a certificate for these names and addresses, valid for `days`. Throws std::runtime_error.
SelfSigned make_self_signed(const std::vector<std::string>& hosts, int days);

// Writes page.crt (0644) and page.key (0600) into `folder`. Never replaces an existing file. Throws
// std::runtime_error.
TlsFiles write_self_signed(const SelfSigned& made, const std::filesystem::path& folder);

}  // namespace loopwarden::http
