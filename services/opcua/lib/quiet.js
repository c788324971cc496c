// SPDX-License-Identifier: Apache-2.0
// Silences the library, which reports problems at length, also on standard output. The callers report failures themselves. Imported
// before the library.
import { setErrorLogger, setWarningLogger } from "node-opcua-debug";

const nobody = () => {};
setErrorLogger(nobody);
setWarningLogger(nobody);
