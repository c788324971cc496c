// SPDX-License-Identifier: Apache-2.0
// Shows the plant of boxes from the host's database.
#include "services/page/fleet/fleet.hpp"

#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"

namespace loopwarden::page::api {
namespace {

constexpr std::size_t kLongestName = 200;

http::Response response_of(std::shared_ptr<const std::string> answer) {
  http::Response response;
  response.shared = std::move(answer);
  return response;
}

// Returns the last data with the reason: a page that was just opened has no other data to show.
http::Response with_last(const fleet::FleetDown& down,
                         const std::shared_ptr<const std::string>& last) {
  http::Response response;
  response.status = 503;
  response.body = dump({{"error", down.what()}});
  if (last) response.body.replace(response.body.size() - 1, 1, ",\"last\":" + *last + "}");
  return response;
}

}  // namespace

http::Response fleet_overview(Context& context, const Call& call) {
  check_query(call.request, {"group"});
  const std::string group = text_in(call.request, "group", kLongestName);
  try {
    return response_of(context.fleet->overview(group));
  } catch (const fleet::FleetDown& e) {
    return with_last(e, context.fleet->last_overview(group));
  }
}

http::Response fleet_valve(Context& context, const Call& call) {
  check_query(call.request, {});
  const auto& path = call.request.path;
  std::shared_ptr<const std::string> answer = context.fleet->valve({path[3], path[4], path[5]});
  if (!answer) throw ApiError(404, "there is no such valve");
  return response_of(std::move(answer));
}

}  // namespace loopwarden::page::api
