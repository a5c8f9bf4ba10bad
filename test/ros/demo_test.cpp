// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "client.hpp"

namespace unirit::test {
namespace {

TEST(Demo, registersTheMovingOrganViewAfterView) {
  Client client("/unirit");
  const auto succeeded = [](const auto& result) {
    return result.status == RegistrationResult::SUCCEEDED;
  };
  const auto first = client.waitForResult(succeeded);
  const auto later = client.waitForResult(
      [&](const auto& result) { return succeeded(result) && result.id > first.id; });
  EXPECT_GT(later.header.stamp, first.header.stamp);
  EXPECT_EQ(later.start, "accepted");

  ASSERT_TRUE(client.waitUntil([&] { return client.deformed.header.stamp >= later.header.stamp; }));
  client.look([&] {
    EXPECT_EQ(client.deformed.width, client.rigid.width);
    EXPECT_GT(client.deformed.width, 1000U);
  });
}

TEST(Demo, showsTheOrganInTheTreeOfFrames) {
  Client client("/unirit");
  EXPECT_TRUE(client.waitUntil([&] {
    for (const auto& transform : client.transforms) {
      if (transform.header.frame_id == "world" && transform.child_frame_id == "preoperative") {
        return true;
      }
    }
    return false;
  }));
}

}  // namespace
}  // namespace unirit::test
