// SPDX-License-Identifier: Apache-2.0
#include "model/effects/cam_obstruction/cam_obstruction.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace cam_obstruction_test {

using loopwarden::effects::CamObstruction;

TEST_CASE("the stem sticks at the bump and jumps past it, both ways", "[plant][cam]") {
  CamObstruction cam(40.0, 5.0, 2.0);
  CHECK(cam.reset(30.0) == 30.0);
  CHECK(cam.step(39.0) == 39.0);
  CHECK(cam.step(41.0) == 40.0);
  CHECK(cam.step(45.0) == 40.0);
  CHECK(cam.step(45.001) == Approx(42.0).margin(0.002));  // jumped
  CHECK(cam.step(50.0) == 47.0);                          // lags by band - jump from here on
  CHECK(cam.step(45.0) == 42.0);
  CHECK(cam.step(41.0) == 42.0);
  CHECK(cam.step(40.0) == 42.0);
  CHECK(cam.step(39.999) == Approx(40.0).margin(0.002));  // jumped back
  CHECK(cam.step(20.0) == 20.0);
}

TEST_CASE("the bump is nowhere else", "[plant][cam]") {
  CamObstruction cam(40.0, 5.0, 2.0);
  cam.reset(10.0);
  for (double u : {11.0, 10.0, 25.0, 39.9, 12.0}) CHECK(cam.step(u) == u);
}

TEST_CASE("it starts on the side where the command is", "[plant][cam]") {
  CamObstruction cam(40.0, 5.0, 2.0);
  CHECK(cam.reset(60.0) == 57.0);
  CHECK(cam.step(60.0) == 57.0);
  CHECK(cam.reset(43.0) == 40.0);
  CHECK(cam.step(43.0) == 40.0);
}

TEST_CASE("severity scales the bump", "[plant][cam]") {
  CamObstruction cam(40.0, 5.0, 2.0);
  cam.reset(30.0);
  cam.set_severity(0.4);
  CHECK(cam.step(41.9) == 40.0);
  CHECK(cam.step(42.1) == Approx(40.9));
  cam.set_severity(0.0);
  for (double u : {42.1, 45.0, 40.5, 39.0, 41.0}) CHECK(cam.step(u) == u);
}

TEST_CASE("a CO that is not a number does not move it past the bump", "[plant][cam]") {
  CamObstruction cam(40.0, 5.0, 2.0);
  cam.reset(30.0);
  CHECK(std::isnan(cam.step(std::numeric_limits<double>::quiet_NaN())));
  CHECK(cam.step(44.0) == 40.0);
}

}  // namespace cam_obstruction_test
