// The script of static pages without depth. Prebuilt: phone_host/report/page_copy.js.

import { connectCopying } from './copying.js';

connectCopying();
