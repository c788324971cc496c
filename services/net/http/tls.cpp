// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/tls.hpp"

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <stdexcept>

#include "base/peer_list.hpp"
#include "base/file.hpp"
#include "base/text.hpp"

namespace loopwarden::http {
namespace {

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* pointer) const noexcept {
    Free(pointer);
  }
};
using ContextPointer = std::unique_ptr<SSL_CTX, Freed<SSL_CTX_free>>;
using KeyPointer = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using CertificatePointer = std::unique_ptr<X509, Freed<X509_free>>;
using ExtensionPointer = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;
using NamesPointer = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;
using StreamPointer = std::unique_ptr<BIO, Freed<BIO_free_all>>;

std::runtime_error failure(const std::string& what) {
  std::array<char, 256> reason{};
  ERR_error_string_n(ERR_get_error(), reason.data(), reason.size());
  ERR_clear_error();
  return std::runtime_error(what + ": " + reason.data());
}

std::string text_of(BIO* memory) {
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(memory, &bytes);
  return {bytes, static_cast<std::size_t>(std::max(size, 0L))};
}

void add_extension(X509* certificate, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const ExtensionPointer extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  if (!extension || X509_add_ext(certificate, extension.get(), -1) != 1) {
    throw failure("the certificate can't have " + value);
  }
}

std::string alternative_names(const std::vector<std::string>& hosts) {
  std::string names;
  for (const std::string& host : hosts) {
    const auto is_sound = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == ':';
    };
    if (host.empty() || !std::all_of(host.begin(), host.end(), is_sound)) {
      throw std::runtime_error("'" + host + "' is not a host name or address");
    }
    const bool address = base::parse_network(host).has_value();
    names += (names.empty() ? "" : ",") + std::string(address ? "IP:" : "DNS:") + host;
  }
  return names;
}

void fill(X509* certificate, EVP_PKEY* key, const std::vector<std::string>& hosts, int days) {
  std::array<unsigned char, 16> serial{};
  RAND_bytes(serial.data(), static_cast<int>(serial.size()));
  serial[0] &= 0x7F;
  std::unique_ptr<BIGNUM, Freed<BN_free>> number(
      BN_bin2bn(serial.data(), static_cast<int>(serial.size()), nullptr));
  BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate));
  X509_set_version(certificate, X509_VERSION_3);
  X509_gmtime_adj(X509_getm_notBefore(certificate), -3600);
  X509_gmtime_adj(X509_getm_notAfter(certificate), 86400L * days);
  X509_set_pubkey(certificate, key);
  X509_NAME* name = X509_get_subject_name(certificate);
  const std::string common = hosts.front().substr(0, 64);
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(common.c_str()), -1, -1, 0);
  X509_set_issuer_name(certificate, name);
  add_extension(certificate, NID_basic_constraints, "critical,CA:FALSE");
  add_extension(certificate, NID_key_usage, "critical,digitalSignature");
  add_extension(certificate, NID_ext_key_usage, "serverAuth");
  add_extension(certificate, NID_subject_alt_name, alternative_names(hosts));
}

void write_new(const std::filesystem::path& path, const std::string& text, unsigned mode) {
  base::File file(path, O_WRONLY | O_CREAT | O_EXCL, mode);
  if (!file.is_open() || !file.write(text.data(), text.size()) || !file.sync() || !file.close()) {
    throw std::runtime_error(path.string() + ": " + base::error_text(errno));
  }
}

}  // namespace

SSL_CTX* make_tls_context(const TlsFiles& files) {
  ContextPointer context(SSL_CTX_new(TLS_server_method()));
  if (!context) throw failure("TLS");
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  SSL_CTX_set_options(context.get(), SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_mode(context.get(), SSL_MODE_RELEASE_BUFFERS);
  if (SSL_CTX_set_cipher_list(context.get(), "ECDHE+AESGCM:ECDHE+CHACHA20") != 1) {
    throw failure("ciphers");
  }
  if (SSL_CTX_use_certificate_chain_file(context.get(), files.certificate.c_str()) != 1) {
    throw failure(files.certificate.string());
  }
  if (SSL_CTX_use_PrivateKey_file(context.get(), files.key.c_str(), SSL_FILETYPE_PEM) != 1) {
    throw failure(files.key.string());
  }
  if (SSL_CTX_check_private_key(context.get()) != 1) {
    throw failure(files.key.string() + " is not the key of " + files.certificate.string());
  }
  return context.release();
}

SelfSigned make_self_signed(const std::vector<std::string>& hosts, int days) {
  const KeyPointer key(EVP_EC_gen("P-256"));
  const CertificatePointer certificate(X509_new());
  if (!key || !certificate) throw failure("a key");
  fill(certificate.get(), key.get(), hosts, days);
  if (X509_sign(certificate.get(), key.get(), EVP_sha256()) == 0) throw failure("the signature");
  const StreamPointer certificate_text(BIO_new(BIO_s_mem()));
  const StreamPointer key_text(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_X509(certificate_text.get(), certificate.get()) != 1 ||
      PEM_write_bio_PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) !=
          1) {
    throw failure("the certificate");
  }
  return {text_of(certificate_text.get()), text_of(key_text.get())};
}

TlsFiles write_self_signed(const SelfSigned& made, const std::filesystem::path& folder) {
  const TlsFiles files{folder / "page.crt", folder / "page.key"};
  write_new(files.key, made.key, 0600);
  write_new(files.certificate, made.certificate, 0644);
  return files;
}

std::vector<std::string> names_in_certificate(const std::filesystem::path& path) {
  const StreamPointer file(BIO_new_file(path.c_str(), "r"));
  const CertificatePointer certificate(
      file ? PEM_read_bio_X509(file.get(), nullptr, nullptr, nullptr) : nullptr);
  if (!certificate) throw failure(path.string());
  const NamesPointer names(static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate.get(), NID_subject_alt_name, nullptr, nullptr)));
  std::vector<std::string> found;
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type != GEN_DNS) continue;
    const ASN1_STRING* text = name->d.dNSName;
    found.push_back(base::lower_case({reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
                                      static_cast<std::size_t>(ASN1_STRING_length(text))}));
  }
  return found;
}

}  // namespace loopwarden::http
