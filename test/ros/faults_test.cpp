// SPDX-License-Identifier: BSD-3-Clause
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <nodelet/NodeletList.h>
#include <nodelet/NodeletLoad.h>
#include <nodelet/NodeletUnload.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "client.hpp"

namespace unirit::test {
namespace {

using Level = diagnostic_msgs::DiagnosticStatus;

/// Levels and sentences of /diagnostics, by name of the status.
class DiagnosticsListener {
 public:
  DiagnosticsListener() {
    subscriber_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 0, [this](const auto& message) {
          const std::lock_guard lock(mutex_);
          for (const auto& status : message->status) statuses_[status.name] = status;
          received_.notify_all();
        });
  }

  /// Waits until the status has this level and its sentence holds these words.
  bool waitFor(const std::string& name, unsigned char level, const std::string& words) {
    std::unique_lock lock(mutex_);
    return received_.wait_for(lock, std::chrono::duration<double>(kDeadline), [&] {
      const auto& status = statuses_[name];
      return status.level == level && status.message.find(words) != std::string::npos;
    });
  }

 private:
  std::mutex mutex_;
  std::condition_variable received_;
  std::map<std::string, diagnostic_msgs::DiagnosticStatus> statuses_;
  ros::NodeHandle nh_;
  ros::Subscriber subscriber_;
};

/// The node answers that it failed, twice, with these words, and says so in its diagnostics.
void expectLivesAndSays(const std::string& node, const std::string& words) {
  Client client("/" + node);
  DiagnosticsListener diagnostics;
  for (unsigned id = 1; id <= 2; ++id) {
    const auto result =
        client.callRegister(requestWith(organCloud(), seenCloud(truePose(), {}))).result;
    EXPECT_EQ(result.status, RegistrationResult::FAILED);
    EXPECT_EQ(result.id, id);
    EXPECT_NE(result.message.find(words), std::string::npos) << result.message;
  }
  EXPECT_TRUE(diagnostics.waitFor(node + ": registration", Level::ERROR, words));
}

TEST(Faults, missingWeightsAreNamed) { expectLivesAndSays("missing_weights", "/nowhere/at/all"); }

TEST(Faults, damagedWeightsAreNamed) { expectLivesAndSays("damaged_weights", "faults.test"); }

TEST(Faults, badParametersAreNamed) {
  expectLivesAndSays("bad_parameters", "/bad_parameters/plausibility/max_residual is -1");
  expectLivesAndSays("wrong_type", "/wrong_type/auto_register is not true or false");
  expectLivesAndSays("bad_pose", "/bad_pose/initial_pose is not a list of the 7 numbers");
}

TEST(Faults, unknownNamesThatResembleTheNodesOwnAreRefused) {
  expectLivesAndSays("misspelt_limit",
                     "/misspelt_limit/plausibilty/max_residual is unknown; the nearest known one "
                     "is plausibility/max_residual");
  expectLivesAndSays("unknown_limit", "/unknown_limit/plausibility/most_folds is unknown");
}

TEST(Faults, absentStartIsRefused) {
  Client client("/no_start");
  client.sendOrgan(organCloud());
  RegisterRequest request = requestWith(organCloud(), seenCloud(truePose(), {}));
  request.use_initial_guess = false;
  const auto result = client.callRegister(request).result;
  EXPECT_EQ(result.status, RegistrationResult::INVALID_INPUT);
  EXPECT_NE(result.message.find("initial_alignment is none"), std::string::npos) << result.message;
}

TEST(Faults, withoutCloudsTheMissingOneIsNamed) {
  Client client("/no_start");
  const auto result = client.callRegister().result;
  EXPECT_EQ(result.status, RegistrationResult::INVALID_INPUT);
  EXPECT_NE(result.message.find("has not been received"), std::string::npos) << result.message;
}

template <class Service>
bool call(const std::string& name, Service& service) {
  bool answered = false;
  return finishes([&] { answered = callService(name, service); }) && answered;
}

void expectRegisters(Client& client) {
  const auto result =
      client.callRegister(requestWith(organCloud(), seenCloud(truePose(), {}))).result;
  EXPECT_EQ(result.status, RegistrationResult::SUCCEEDED) << result.message;
}

TEST(Faults, unknownNamesOfOthersAreWarnedOfAlone) {
  Client client("/others_parameters");
  expectRegisters(client);
  DiagnosticsListener diagnostics;
  EXPECT_TRUE(diagnostics.waitFor(
      "others_parameters: registration", Level::WARN,
      "parameter /others_parameters/camera/width is unknown and has no effect"));
}

TEST(Managers, unloadDuringARegistrationEndsItAndNothingElse) {
  Client first("/first"), second("/second");
  expectRegisters(first);
  expectRegisters(second);

  // A registration that takes long enough to be unloaded under
  const auto crowd = message(Points(truePose().cast<float>() * organ(400000)), kCameraFrame, {});
  const auto request = requestWith(organCloud(), crowd);
  std::atomic<int> answered{0};
  std::thread registering([&] {
    Register service;
    service.request = request;
    while (callService("/first/register", service)) ++answered;
  });
  while (answered == 0) std::this_thread::yield();  // from here on one is always under way
  nodelet::NodeletUnload unload;
  unload.request.name = "/first";
  EXPECT_TRUE(call("/first_manager/unload_nodelet", unload) && unload.response.success);
  registering.join();
  nodelet::NodeletList list;
  EXPECT_TRUE(call("/first_manager/list", list));
  EXPECT_TRUE(list.response.nodelets.empty());
  expectRegisters(second);

  // The manager lives and takes the nodelet again
  nodelet::NodeletLoad load;
  load.request.name = "/first";
  load.request.type = "unirit/RegistrationNodelet";
  EXPECT_TRUE(call("/first_manager/load_nodelet", load) && load.response.success);
  Client again("/first");
  expectRegisters(again);

  // and finds nothing wrong with what its first life left on the parameter server
  DiagnosticsListener diagnostics;
  EXPECT_TRUE(diagnostics.waitFor("first: registration", Level::OK, ""));
}

}  // namespace
}  // namespace unirit::test
