// SPDX-License-Identifier: Apache-2.0
#include "lab/program/labels.hpp"

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::labels_test {

TEST_CASE("labels: plant and kind from such columns, otherwise the letters of the file's name",
          "[studies]") {
  const TemporaryFolder folder;
  std::ofstream(folder / "bare.csv") << "file,loop,sticky\nCHEM10.csv,CHEM10,1\n10.csv,x,0\n";
  const auto bare = lab::read_labels(folder / "bare.csv");
  REQUIRE(bare.size() == 2);
  CHECK(bare[0].plant == "CHEM");
  CHECK(bare[0].kind.empty());
  CHECK(bare[1].plant == "10.csv");
  std::ofstream(folder / "full.csv") << "kind,file,loop,plant,sticky\nflow,r1.csv,A,routine,1\n";
  const auto full = lab::read_labels(folder / "full.csv");
  REQUIRE(full.size() == 1);
  CHECK(full[0].plant == "routine");
  CHECK(full[0].kind == "flow");
  CHECK(full[0].sticky);
}

}  // namespace loopwarden::tests::labels_test
