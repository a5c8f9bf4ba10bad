// SPDX-License-Identifier: BSD-3-Clause
#include <nodelet/nodelet.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "registration_server.hpp"

namespace unirit {

/// The registration as a nodelet: unirit/RegistrationNodelet.
class RegistrationNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    server_ = std::make_unique<RegistrationServer>(getNodeHandle(), getPrivateNodeHandle());
  }

  std::unique_ptr<RegistrationServer> server_;
};

}  // namespace unirit

PLUGINLIB_EXPORT_CLASS(unirit::RegistrationNodelet, nodelet::Nodelet)
