// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <std_srvs/SetBool.h>

#include <fstream>
#include <set>

#include "client.hpp"
#include "names.hpp"
#include "session.hpp"

namespace unirit::test {
namespace {

/// Each cloud of the session is registered once and in order, whatever the speed of the replay;
/// what came of it is written to the file ~output, compute times aside, to be compared with another
/// run.
TEST(Replay, everyCloudIsRegisteredInOrder) {
  std::vector<sensor_msgs::PointCloud2> deformed;
  Client client("/unirit");
  ros::NodeHandle nh;
  const auto listener = nh.subscribe<sensor_msgs::PointCloud2>(
      "/unirit/deformed", 0,
      [&](const auto& cloud) { client.look([&] { deformed.push_back(*cloud); }); });

  std_srvs::SetBool resume;
  ASSERT_TRUE(ros::service::waitForService("/player/pause_playback", ros::Duration(kDeadline)));
  ASSERT_TRUE(callService("/player/pause_playback", resume));
  ASSERT_TRUE(client.waitUntil([&] { return client.results.size() == kSessionViews; }))
      << client.results.size() << " results";

  std::ofstream output(ros::param::param<std::string>("~output", ""));
  std::size_t succeeded = 0;
  client.look([&] {
    for (std::size_t i = 0; i < client.results.size(); ++i) {
      RegistrationResult result = client.results[i];
      EXPECT_EQ(result.id, i + 1);
      EXPECT_EQ(result.start, i == 0 ? names::kStartGuess : names::kStartAccepted);
      if (i > 0) {
        EXPECT_GT(result.header.stamp, client.results[i - 1].header.stamp);
      }
      succeeded += result.status == RegistrationResult::SUCCEEDED ? 1 : 0;
      result.header.seq = 0;
      result.stage_milliseconds.clear();
      output.precision(17);
      output << result;
    }
  });
  EXPECT_EQ(succeeded, std::size_t{kSessionViews});
  ASSERT_TRUE(client.waitUntil([&] { return deformed.size() == succeeded; }));
  for (const auto& cloud : deformed) {
    output.write(reinterpret_cast<const char*>(cloud.data.data()),
                 static_cast<std::streamsize>(cloud.data.size()));
  }
  output.close();
  EXPECT_FALSE(output.fail());
}

}  // namespace
}  // namespace unirit::test
