// SPDX-License-Identifier: Apache-2.0
// Own key and certificate, made if they are missing, and the trusted certificates of servers. An administrator trusts each one explicitly.
// Each is a file of trusted/, PEM or DER, and is valid until it expires or is removed. Authorities and revocation lists don't count.
import { X509Certificate } from "node:crypto";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { OPCUACertificateManager } from "node-opcua-certificate-manager";

const OWN_DAYS = 3650;

export class Untrusted extends Error {}
export class Expired extends Error {}

// Returns the first certificate of a chain in DER: an endpoint appends its issuers.
export function leafOf(der) {
  const length = der[0] === 0x30 && der[1] === 0x82 ? 4 + der.readUInt16BE(2) : der.length;
  return new X509Certificate(der.subarray(0, length));
}

export function describe(certificate) {
  return `${certificate.subject.replaceAll("\n", ", ")}, valid from ${certificate.validFrom} to ${certificate.validTo}\nSHA-256 ${certificate.fingerprint256}`;
}

const outOfTime = (certificate) => Date.now() < Date.parse(certificate.validFrom) || Date.now() > Date.parse(certificate.validTo);

export class Certificates {
  #trusted;

  // Makes missing folders and files below `directory`.
  static async open(directory) {
    const certificates = new Certificates();
    const folder = path.join(directory, "pki");
    certificates.#trusted = path.join(directory, "trusted");
    fs.mkdirSync(certificates.#trusted, { recursive: true, mode: 0o750 });
    fs.mkdirSync(folder, { recursive: true, mode: 0o700 }); // has the key, which the library writes readable for all
    certificates.manager = new OPCUACertificateManager({ rootFolder: folder, automaticallyAcceptUnknownCertificate: false });
    await certificates.manager.initialize();
    fs.chmodSync(certificates.privateKeyFile, 0o600);
    certificates.file = path.join(folder, "own/certs/certificate.pem");
    if (!fs.existsSync(certificates.file)) {
      await certificates.manager.createSelfSignedCertificate({
        applicationUri: `urn:${os.hostname()}:loopwarden-opcua`,
        dns: [os.hostname()],
        subject: `/CN=loopwarden-opcua@${os.hostname()}`,
        outputFile: certificates.file,
        startDate: new Date(),
        validity: OWN_DAYS,
      });
    }
    return certificates;
  }

  get own() {
    return new X509Certificate(fs.readFileSync(this.file));
  }
  // The name as in the certificate: servers compare it, and the host's name may have changed since.
  get applicationUri() {
    return /URI:([^,\s]+)/.exec(this.own.subjectAltName)[1];
  }
  get privateKeyFile() {
    return this.manager.privateKey;
  }

  // Throws Untrusted, Expired.
  check(der) {
    const certificate = leafOf(der);
    const file = this.#files().find((one) => one.certificate.raw.equals(certificate.raw))?.file;
    if (!file) throw new Untrusted(`the server's certificate is not trusted:\n${describe(certificate)}`);
    if (outOfTime(certificate)) throw new Expired(`the server's certificate ${file} is valid only from ${certificate.validFrom} to ${certificate.validTo}`);
  }
  checkOwn() {
    const { own } = this;
    if (outOfTime(own)) {
      throw new Expired(`own certificate ${this.file}: valid only from ${own.validFrom} to ${own.validTo}. Remove it: the next start makes a new one`);
    }
  }

  // Returns the path of the new file. Throws Untrusted if the fingerprint differs.
  trust(der, fingerprint) {
    const plain = (text) => text.replaceAll(/[^0-9a-fA-F]/g, "").toLowerCase();
    const certificate = leafOf(der);
    if (plain(fingerprint) !== plain(certificate.fingerprint256)) throw new Untrusted(`the server's certificate has another fingerprint:\n${describe(certificate)}`);
    const file = path.join(this.#trusted, `${plain(certificate.fingerprint256)}.pem`);
    fs.writeFileSync(file, certificate.toString());
    return file;
  }

  #files() {
    return fs.readdirSync(this.#trusted).flatMap((name) => {
      const file = path.join(this.#trusted, name);
      try {
        return [{ file, certificate: new X509Certificate(fs.readFileSync(file)) }];
      } catch {
        return []; // no certificate
      }
    });
  }
}
