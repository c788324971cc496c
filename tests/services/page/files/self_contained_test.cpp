// SPDX-License-Identifier: Apache-2.0
#include "services/page/files/self_contained.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::self_contained_test {

using Parts = std::vector<std::string>;

std::string made(const std::string& html, const Parts& page = {"pages", "1.html"}) {
  return page::files::self_contained(html, page,
                                     [](const Parts& parts) -> std::optional<std::string> {
                                       if (parts == Parts{"assets", "a.css"}) return "b {}";
                                       if (parts == Parts{"assets", "a.js"}) return "run();";
                                       if (parts == Parts{"assets", "odd.js"}) return "'</script>'";
                                       return std::nullopt;
                                     });
}

TEST_CASE("files next to a report are put into it") {
  CHECK(made("<p><link rel=\"stylesheet\" href=\"../assets/a.css\">x<script "
             "src=\"../assets/a.js\"></script>y") ==
        "<p><style>b {}</style>x<script>run();</script>y");
  CHECK(made("<script src=\"assets/a.js\"></script>", {"survey.html"}) ==
        "<script>run();</script>");
}

TEST_CASE(
    "an address outside the folder, on another host or that would end its element is not "
    "replaced") {
  for (const char* address : {"../../assets/a.js", "https://evil/a.js", "/assets/a.js",
                              "../assets/none.js", "../assets/odd.js", "..", "", "../.hidden"}) {
    const std::string html = std::string("<script src=\"") + address + "\"></script>";
    CHECK(made(html) == html);
  }
  CHECK(made("<script src=\"../assets/a.js") == "<script src=\"../assets/a.js");
}

}  // namespace loopwarden::tests::self_contained_test
