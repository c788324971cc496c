// SPDX-License-Identifier: Apache-2.0
// The library tells its troubles at length, on standard output too. What fails is told by whoever asked for it. Imported
// before the library.
import { setErrorLogger, setWarningLogger } from "node-opcua-debug";

const nobody = () => {};
setErrorLogger(nobody);
setWarningLogger(nobody);
