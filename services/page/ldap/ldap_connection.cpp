// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/ldap_connection.hpp"

#include <fmt/format.h>
#include <lber.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <poll.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <string_view>

namespace loopwarden::page::ldap {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostEntries = 2;  // one more than the expected one
constexpr int kBelowTls = (LBER_SBIOD_LEVEL_PROVIDER + LBER_SBIOD_LEVEL_TRANSPORT) / 2;

timeval as_timeval(std::chrono::milliseconds time) {
  return {time.count() / 1000, (time.count() % 1000) * 1000};
}

// Sets an option of `handle`, or with null the default of later handles.
void set(LDAP* handle, int option, const void* value, const char* what) {
  if (ldap_set_option(handle, option, value) != LDAP_OPT_SUCCESS) throw LdapTrouble(what);
}

std::string no_authority(const LdapSettings& settings) {
  return settings.ca_file.string() + ": contains no CA certificate (PEM), or is missing";
}

void set_tls(LDAP* handle, const LdapSettings& settings) {
  const int demand = LDAP_OPT_X_TLS_DEMAND;
  const int oldest = LDAP_OPT_X_TLS_PROTOCOL_TLS1_2;
  const int client = 0;
  const std::string unusable = no_authority(settings);
  set(handle, LDAP_OPT_X_TLS_CACERTDIR, nullptr, "libldap keeps its authorities");
  set(handle, LDAP_OPT_X_TLS_CACERTFILE, settings.ca_file.c_str(), unusable.c_str());
  set(handle, LDAP_OPT_X_TLS_REQUIRE_CERT, &demand, "libldap can't demand a certificate");
  set(handle, LDAP_OPT_X_TLS_PROTOCOL_MIN, &oldest, "libldap can't demand TLS 1.2");
  set(handle, LDAP_OPT_X_TLS_NEWCTX, &client, unusable.c_str());
}

LDAP* new_handle(const std::string& server) {
  // Before libldap's first call, which would read these files, and before a service starts threads.
  static const int no_files = ::setenv("LDAPNOINIT", "1", 1);
  if (no_files != 0) throw LdapTrouble("no memory");
  LDAP* handle = nullptr;
  // With ldap: instead of ldaps:, libldap only connects. begin_tls() starts TLS.
  const int error = ldap_initialize(&handle, ("ldap://" + server).c_str());
  if (error != LDAP_SUCCESS) throw LdapTrouble(server + ": " + ldap_err2string(error));
  return handle;
}

// Returns the reason of a refused password. Active Directory reports it only in its diagnostics:
// "... data 52e, v4563".
std::string_view reason_of_ad(std::string_view diagnostics) {
  struct Reason {
    std::string_view code;
    std::string_view words;
  };
  constexpr std::array kReasons{
      Reason{"data 525,", "no such account"},      Reason{"data 52e,", "wrong password"},
      Reason{"data 530,", "not at this hour"},     Reason{"data 531,", "not from this machine"},
      Reason{"data 532,", "password has expired"}, Reason{"data 533,", "account is disabled"},
      Reason{"data 701,", "account has expired"},  Reason{"data 773,", "password must be changed"},
      Reason{"data 775,", "account is locked"}};
  for (const Reason& reason : kReasons) {
    if (diagnostics.find(reason.code) != std::string_view::npos) return reason.words;
  }
  return {};
}

}  // namespace

// Limits the time of a TLS handshake by GnuTLS, which libldap's own limits don't reach: it loops
// while the server is silent.
class Connection::Limit {
 public:
  explicit Limit(Sockbuf* buffer) {
    ber_sockbuf_ctrl(buffer, LBER_SB_OPT_GET_FD, &fd_);
    static Sockbuf_IO layer{set_up, remove, control, read, write, close};
    if (ber_sockbuf_add_io(buffer, &layer, kBelowTls, this) != 0) {
      throw LdapTrouble("libldap takes no limit");
    }
  }
  void restart(Clock::time_point end) { end_ = end; }
  bool has_passed() const { return passed_; }

 private:
  static int set_up(Sockbuf_IO_Desc* layer, void* self) {
    layer->sbiod_pvt = self;
    return 0;
  }
  static int remove(Sockbuf_IO_Desc*) { return 0; }
  static int close(Sockbuf_IO_Desc*) { return 0; }
  static int control(Sockbuf_IO_Desc* layer, int option, void* argument) {
    return LBER_SBIOD_CTRL_NEXT(layer, option, argument);
  }
  static ber_slen_t read(Sockbuf_IO_Desc* layer, void* bytes, ber_len_t count) {
    return of(layer).waits(POLLIN) ? LBER_SBIOD_READ_NEXT(layer, bytes, count) : -1;
  }
  static ber_slen_t write(Sockbuf_IO_Desc* layer, void* bytes, ber_len_t count) {
    return of(layer).waits(POLLOUT) ? LBER_SBIOD_WRITE_NEXT(layer, bytes, count) : -1;
  }
  static Limit& of(Sockbuf_IO_Desc* layer) { return *static_cast<Limit*>(layer->sbiod_pvt); }

  // Never returns "try again", which would make GnuTLS loop.
  bool waits(short what) {
    pollfd socket{fd_, what, 0};
    int ready = -1;
    do {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - Clock::now()).count();
      ready = left > 0 ? ::poll(&socket, 1, static_cast<int>(left)) : 0;
    } while (ready < 0 && errno == EINTR);
    if (ready > 0) return true;
    passed_ = true;
    errno = ETIMEDOUT;
    return false;
  }

  int fd_ = -1;
  Clock::time_point end_;
  bool passed_ = false;
};

Connection::Connection(const std::string& server, const LdapSettings& settings,
                       std::chrono::milliseconds limit, Moment until)
    : server_(server), limit_(limit), until_(until), handle_(new_handle(server)) {
  try {
    set_options(settings);
    const int error = ldap_connect(handle_);
    if (error != LDAP_SUCCESS) fail("can't be reached", error);
    begin_tls(settings);
  } catch (...) {
    ldap_unbind_ext_s(handle_, nullptr, nullptr);
    throw;
  }
}

Connection::~Connection() {
  below_tls_->restart(std::min(Clock::now() + limit_, until_));
  ldap_unbind_ext_s(handle_, nullptr, nullptr);
}

Connection::Moment Connection::end_of_step() const {
  const Moment now = Clock::now();
  if (now >= until_) throw LdapTrouble(server_ + ": no time is left");
  return std::min(now + limit_, until_);
}

void Connection::set_options(const LdapSettings& settings) {
  const int version = LDAP_VERSION3;
  const int never = LDAP_DEREF_NEVER;
  const timeval limit = as_timeval(
      std::max(std::chrono::ceil<std::chrono::milliseconds>(end_of_step() - Clock::now()),
               std::chrono::milliseconds(1)));
  constexpr const char* kRefused = "libldap takes no option";
  set(handle_, LDAP_OPT_PROTOCOL_VERSION, &version, kRefused);
  set(handle_, LDAP_OPT_REFERRALS, LDAP_OPT_OFF, kRefused);
  set(handle_, LDAP_OPT_DEREF, &never, kRefused);
  set(handle_, LDAP_OPT_RESTART, LDAP_OPT_ON, kRefused);  // a signal is no answer
  set(handle_, LDAP_OPT_NETWORK_TIMEOUT, &limit, kRefused);
  set(handle_, LDAP_OPT_TIMEOUT, &limit, kRefused);
  set_tls(handle_, settings);
}

void Connection::begin_tls(const LdapSettings& settings) {
  Sockbuf* buffer = nullptr;
  ldap_get_option(handle_, LDAP_OPT_SOCKBUF, &buffer);
  below_tls_ = std::make_unique<Limit>(buffer);
  below_tls_->restart(end_of_step());
  const int error =
      settings.start_tls ? ldap_start_tls_s(handle_, nullptr, nullptr) : ldap_install_tls(handle_);
  if (error == LDAP_SUCCESS && ldap_tls_inplace(handle_) != 0) return;
  if (error == LDAP_TIMEOUT || below_tls_->has_passed()) fail("TLS: no answer", LDAP_TIMEOUT);
  fail(fmt::format("TLS: not offered here, or the certificate is not by {} or not for this name",
                   settings.ca_file.string()),
       error);
}

std::string Connection::said() const {
  char* words = nullptr;
  ldap_get_option(handle_, LDAP_OPT_DIAGNOSTIC_MESSAGE, &words);
  std::string text = words == nullptr ? "" : words;
  ldap_memfree(words);
  // libldap's text for a refused certificate with GnuTLS.
  return text == "(unknown error code)" ? "" : text;
}

void Connection::fail(const std::string& what, int error) const {
  const std::string words = said();
  throw LdapTrouble(fmt::format("{}: {} ({}{}{})", server_, what, ldap_err2string(error),
                                words.empty() ? "" : ": ", words));
}

std::string Connection::tls_version() const {
  char* version = nullptr;
  ldap_get_option(handle_, LDAP_OPT_X_TLS_VERSION, &version);
  std::string text = version == nullptr ? "TLS" : version;
  ldap_memfree(version);
  return text;
}

std::string Connection::bind(const std::string& dn, const std::string& password) {
  if (dn.empty() || password.empty()) return "the password is empty";
  below_tls_->restart(end_of_step());
  std::string bytes = password;
  berval secret{bytes.size(), bytes.data()};
  const int error =
      ldap_sasl_bind_s(handle_, dn.c_str(), LDAP_SASL_SIMPLE, &secret, nullptr, nullptr, nullptr);
  switch (error) {
    case LDAP_SUCCESS: return {};
    case LDAP_INVALID_CREDENTIALS:
    case LDAP_NO_SUCH_OBJECT:
    case LDAP_INVALID_DN_SYNTAX:
    case LDAP_INAPPROPRIATE_AUTH:
    case LDAP_INSUFFICIENT_ACCESS:
    case LDAP_CONSTRAINT_VIOLATION:
    case LDAP_UNWILLING_TO_PERFORM: break;
    default: fail("bind", error);
  }
  const std::string words = said();
  const std::string_view reason = reason_of_ad(words);
  if (!reason.empty()) return std::string(reason);
  return words.empty() ? ldap_err2string(error)
                       : fmt::format("{}: {}", ldap_err2string(error), words);
}

std::optional<std::vector<std::string>> Connection::find(const std::string& base, Depth depth,
                                                         const std::string& filter) {
  below_tls_->restart(end_of_step());
  std::string no_attribute = LDAP_NO_ATTRS;
  std::array<char*, 2> attributes{no_attribute.data(), nullptr};
  timeval limit = as_timeval(limit_);
  LDAPMessage* found = nullptr;
  const int error = ldap_search_ext_s(
      handle_, base.c_str(), depth == Depth::entry_itself ? LDAP_SCOPE_BASE : LDAP_SCOPE_SUBTREE,
      filter.c_str(), attributes.data(), 0, nullptr, nullptr, &limit, kMostEntries, &found);
  const std::unique_ptr<LDAPMessage, int (*)(LDAPMessage*)> owned(found, ldap_msgfree);
  if (error == LDAP_NO_SUCH_OBJECT) return std::nullopt;
  if (error != LDAP_SUCCESS && error != LDAP_SIZELIMIT_EXCEEDED) {
    fail("search at " + base, error);
  }
  std::vector<std::string> names;
  for (LDAPMessage* entry = ldap_first_entry(handle_, found); entry != nullptr;
       entry = ldap_next_entry(handle_, entry)) {
    char* name = ldap_get_dn(handle_, entry);
    if (name != nullptr && *name != '\0') names.emplace_back(name);
    ldap_memfree(name);
  }
  return names;
}

void check_ca_file(const LdapSettings& settings) {
  // libldap accepts a file without any certificate, and then trusts no server.
  const std::unique_ptr<BIO, int (*)(BIO*)> file(BIO_new_file(settings.ca_file.c_str(), "r"),
                                                 BIO_free);
  const std::unique_ptr<X509, void (*)(X509*)> authority(
      file ? PEM_read_bio_X509(file.get(), nullptr, nullptr, nullptr) : nullptr, X509_free);
  if (!authority) throw LdapTrouble(no_authority(settings));
  LDAP* handle = new_handle("localhost");
  const std::unique_ptr<LDAP, void (*)(LDAP*)> owned(
      handle, [](LDAP* one) { ldap_unbind_ext_s(one, nullptr, nullptr); });
  set_tls(handle, settings);
}

}  // namespace loopwarden::page::ldap
