// Requests to the server of `surflect view`. Counts those in flight, so that tests can tell that one waits for another.

// An answer that is not 200, or none (status 0), to a request of a path. `said` is its JSON.
export class ServerError extends Error {
  constructor(path, status, message, said = {}) {
    super(message);
    this.path = path;
    this.status = status;
    this.said = said;
  }
}

function randomHex(bytes) {
  return [...crypto.getRandomValues(new Uint8Array(bytes))]
    .map((b) => b.toString(16).padStart(2, "0"))
    .join("");
}

export class Server {
  // The token comes once in the address and stays with the tab. The tab's name is new with each load of the page, as a
  // duplicated tab would share a stored one.
  constructor(token) {
    if (token) sessionStorage.setItem("surflect.token", token);
    this.token = sessionStorage.getItem("surflect.token") ?? "";
    this.tab = randomHex(8);
    this.inFlight = 0;
    this.mostInFlight = 0;
  }

  headers(hasBody) {
    return {
      "X-Surflect-Token": this.token,
      "X-Surflect-Tab": this.tab,
      ...(hasBody ? { "Content-Type": "application/json" } : {}),
    };
  }

  // One request; throws ServerError, or AbortError when `signal` aborts it.
  async ask(path, { body, signal } = {}) {
    let response;
    try {
      response = await fetch(path, {
        method: body === undefined ? "GET" : "POST",
        cache: "no-store",
        signal,
        headers: this.headers(body !== undefined),
        body: body === undefined ? undefined : JSON.stringify(body),
      });
    } catch (error) {
      throw error.name === "AbortError" ? error : new ServerError(path, 0, "the server does not answer");
    }
    if (response.ok) return response;
    const said = await response.json().catch(() => ({}));
    throw new ServerError(path, response.status, said.error ?? `the server answered ${response.status}`, said);
  }

  async counted(work) {
    this.mostInFlight = Math.max(this.mostInFlight, ++this.inFlight);
    try {
      return await work();
    } finally {
      --this.inFlight;
    }
  }

  start() {
    return this.counted(async () => (await this.ask("/start")).json());
  }

  // An answer as JSON.
  post(path, body, signal) {
    return this.counted(async () => (await this.ask(path, { body, signal })).json());
  }

  // A picture: its bytes and what the server says of it.
  picture(path, body, signal) {
    return this.counted(async () => {
      const response = await this.ask(path, { body, signal });
      const said = response.headers.get("X-Picture");
      const blob = await response.blob().catch((error) => {
        throw error.name === "AbortError" ? error : new ServerError(path, 0, "the server does not answer");
      });
      return { blob, said: said ? JSON.parse(said) : {} };
    });
  }

  // Waits up to 20 s for events; not counted, as it renders nothing.
  async events(after, signal) {
    return (await this.ask(`/events?after=${after}`, { signal })).json();
  }

  // Ends a recording, whose own request is still in flight.
  async stop() {
    await this.ask("/stop", { body: {} });
  }

  // Lets the server forget the tab; sent even as the page goes away.
  leave() {
    fetch("/leave", { method: "POST", keepalive: true, headers: this.headers(true), body: "{}" }).catch(
      () => {},
    );
  }

  // Names the tab anew, after leave().
  comeBack() {
    this.tab = randomHex(8);
  }
}
